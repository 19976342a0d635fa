"""`truepose completion`: the Tab key completes commands, options, files, kinds and keys."""

from __future__ import annotations

import click


@click.command("completion")
@click.argument("shell", metavar="SHELL", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(context: click.Context, shell: str) -> int:
    """Print what makes the Tab key complete, for SHELL.

    For bash, zsh or fish: commands, options, files by their endings, kinds of machine,
    controllers, codes, and for --set the keys of the machine file that stands before it on the
    line. To turn it on for good:

    \b
    bash: echo 'eval "$(truepose completion bash)"' >> ~/.bashrc
    zsh:  echo 'eval "$(truepose completion zsh)"' >> ~/.zshrc
    fish: echo 'truepose completion fish | source' >> ~/.config/fish/config.fish

    Of zsh, compinit must have run before. Then open a new shell.
    """  # noqa: D301  click's mark for lines that are not to be joined
    from truepose.cli._shells import script

    click.echo(script(shell, context.find_root().command), nl=False)
    return 0
