"""Bytes are counted once, for the package whose they are."""

from __future__ import annotations

from pathlib import Path

from release.installed_size import package_sizes


def test_sizes_are_of_their_packages(tmp_path: Path) -> None:
    for name, size in (("one", 1000), ("two", 20)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "data").write_bytes(b"x" * size)
        info = tmp_path / f"{name}-1.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
        # The second lists a file of the first, too, and one that is not there.
        (info / "RECORD").write_text(f"{name}/data,,\none/data,,\nnowhere,,\n")
    (tmp_path / "stray").write_bytes(b"x" * 3)
    sizes = package_sizes(tmp_path)
    records = sum(p.stat().st_size for p in tmp_path.glob("*/*") if p.name != "data")
    assert sizes["one"] + sizes["two"] == 1020
    assert sizes["(of no package)"] == records + 3
