"""The commands that compute nothing: validate, schema, keys, columns, materials."""

import click

from cablestudy.cli.error_handling import WRONG_USE, echo_notes, handle_errors, show
from cablestudy.cli.options import FORMAT, PATH, QUIET, SET


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=PATH)
@SET
@FORMAT
@QUIET
@handle_errors
def validate(files, sets, style, quiet):
    """Read and check scenes and studies; compute nothing."""
    from cablestudy.interface import files as interface

    table, mistakes, notes = interface.validate(files, sets)
    echo_notes(notes, quiet)
    for mistake in mistakes:
        click.echo(str(mistake), err=True)
    show(table, style)
    return WRONG_USE if mistakes else 0


@click.command()
@click.argument("kind", type=click.Choice(["scene", "suspension", "study"]))
@handle_errors
def schema(kind):
    """JSON Schema of a file, for editors."""
    import json

    from cablestudy.interface import files as interface

    click.echo(json.dumps(interface.schema(kind), indent=2, ensure_ascii=False))


@click.command()
@click.argument("kind", type=click.Choice(["scene", "suspension", "study"]))
@click.argument("beginning", default="", metavar="[KEY]")
@FORMAT
@handle_errors
def keys(kind, beginning, style):
    """Every key of a file, or those that begin with KEY: unit, default, meaning, what is allowed."""
    from cablestudy.interface import files as interface

    show(interface.keys(kind, beginning), style)


@click.command()
@click.argument("text", default="", metavar="[TEXT]")
@FORMAT
@handle_errors
def columns(text, style):
    """Every column, or those with TEXT in their names: unit, meaning, needs."""
    from cablestudy.interface import files as interface

    show(interface.columns(text), style)


@click.command()
@click.argument("files", nargs=-1, metavar="[FILE...]", type=PATH)
@FORMAT
@handle_errors
def materials(files, style):
    """Materials and ropes with their numbers and sources: of files of them, of scenes and studies, and built-in."""
    from cablestudy.interface import files as interface

    show(interface.materials(files), style)
