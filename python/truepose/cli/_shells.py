"""How shells ask for completions and are answered: click's protocol, with files and open keys.

Beyond click's own scripts these quote names of files, put no space behind a key that goes on, and
take `*` for itself. Each shell is a class; `truepose completion SHELL` prints its script.
"""

from __future__ import annotations

import click
from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ZshComplete,
    add_completion_class,
)

from truepose.cli._complete import COMPLETION, OPEN

_BASH = """\
%(complete_func)s() {
    local response kind value
    response=$(COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD \
%(complete_var)s=bash_complete "$1" 2>/dev/null)
    COMPREPLY=()
    while IFS=',' read -r kind value; do
        case $kind in
            '') ;;
            path) compopt -o filenames; COMPREPLY+=("${value%%/}") ;;
            open) compopt -o nospace; COMPREPLY+=("$value") ;;
            *) COMPREPLY+=("$value") ;;
        esac
    done <<< "$response"
}

complete -o nosort -F %(complete_func)s %(prog_name)s
"""

_ZSH = """\
#compdef %(prog_name)s

%(complete_func)s() {
    local kind value help
    local -a plain described open response
    (( ! $+commands[%(prog_name)s] )) && return 1
    response=("${(@f)$(COMP_WORDS="${words[*]}" COMP_CWORD=$((CURRENT-1)) \
%(complete_var)s=zsh_complete %(prog_name)s 2>/dev/null)}")
    for kind value help in ${response}; do
        if [[ "$kind" == open || "$value" == */ ]]; then
            open+=("$value")
        elif [[ "$help" == _ ]]; then
            plain+=("$value")
        else
            described+=("${value//:/\\\\:}:$help")
        fi
    done
    (( $#described )) && _describe -V unsorted described -U
    (( $#plain )) && compadd -U -V unsorted -a plain
    (( $#open )) && compadd -U -V unsorted -S '' -a open
}

if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    %(complete_func)s "$@"
else
    compdef %(complete_func)s %(prog_name)s
fi
"""

_FISH = """\
function %(complete_func)s
    set -l response (COMP_WORDS=(commandline -cp) COMP_CWORD=(commandline -t) \
%(complete_var)s=fish_complete %(prog_name)s 2>/dev/null)
    for line in $response
        string split -m1 -f2 "," -- $line
    end
end

complete --no-files --command %(prog_name)s --arguments "(%(complete_func)s)"
"""


class Bash(BashComplete):
    """Bash from 4.4 on. `COMP_WORDS` has every word in quotes as it was typed."""

    source_template = _BASH

    def format_completion(self, item: CompletionItem) -> str:
        """A line of what it is and its text."""
        return f"{item.type},{item.value}"


class Zsh(ZshComplete):
    """Z shell, with completion turned on (`compinit`)."""

    source_template = _ZSH

    def format_completion(self, item: CompletionItem) -> str:
        """Three lines: what it is, its text, and what it means or `_`."""
        return f"{item.type}\n{item.value}\n{_one_line(item.help) or '_'}"


class Fish(FishComplete):
    """Fish, which puts no space behind `=`, `/` and `.` by itself."""

    source_template = _FISH

    def format_completion(self, item: CompletionItem) -> str:
        """A line of what it is and its text, and behind a tab what it means."""
        kind = "plain" if item.type == OPEN else item.type
        return f"{kind},{item.value}" + (f"\t{_one_line(item.help)}" if item.help else "")


SHELLS = {shell.name: shell for shell in (Bash, Zsh, Fish)}
"""Name of a shell -> how it is answered."""


def script(shell: str, command: click.Command) -> str:
    """What a shell is to read once to complete the lines of `truepose`."""
    asked = SHELLS[shell](command, {}, "truepose", COMPLETION)
    return asked.source_template % asked.source_vars()


def answer_shells() -> None:
    """Let click answer these shells so, where one asks."""
    for shell in SHELLS.values():
        add_completion_class(shell)


def _one_line(text: str | None) -> str:
    return " ".join((text or "").split())
