"""Many kills, over all commands; exit code 1 where a file is half or a set is mixed."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.progress import track

from kills import COMMANDS, Killed, Kills
from truepose.reporting.live import part


def main() -> int:
    """Run and tell."""
    parser = argparse.ArgumentParser(prog="kills")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)  # noqa: S311
    names = [name for name in COMMANDS if name != "live" or part.is_built()]
    found: list[Killed] = []
    with tempfile.TemporaryDirectory() as folder:
        kept: dict[str, Kills] = {}
        console = Console(stderr=True)
        for number in track(range(options.count), "kills", console=console):
            name = names[number % len(names)]
            if name not in kept:
                kept[name] = Kills(name, Path(folder) / str(len(kept)))
            found.append(kept[name].one(chance, aimed=number // len(names) % 2 == 1))
    for name in names:
        own = [kill for kill in found if kill.command == name]
        states = Counter("/".join(sorted(set(kill.files.values()))) for kill in own)
        files = max((len(kill.files) for kill in own), default=0)
        print(f"{name:16} {len(own):4} kills, {files} files: {dict(states)}")
    bad = [kill for kill in found if kill.half or (kill.mixed and not kill.told)]
    for kill in bad:
        print(kill)
    alive = sum(not kill.ended for kill in found)
    told = sum(kill.mixed and kill.told for kill in found)
    print(f"{len(found)} kills, {alive} of them before the end; mixed and refused: {told}")
    print(f"half, or mixed and not refused: {len(bad)}")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
