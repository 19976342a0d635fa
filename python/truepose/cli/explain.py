import click


@click.command("explain")
def command():
    return 0
