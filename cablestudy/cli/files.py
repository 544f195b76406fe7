"""The commands on files: new, freeze, and those that compute nothing: validate, schema, keys, columns, materials."""

import os

import click

from cablestudy.cli.error_handling import WRONG_USE, echo_notes, show
from cablestudy.cli.options import FORMAT, PATH, QUIET, SCENE, SET, plain_command
from cablestudy.cli.tables import write_utf8
from cablestudy.errors import SceneError

# Kind of file -> what to try with it; {} is its name.
NEXT = {
    "guy": ("static {} --case all", "modes {} -n 6", "find {} 'sag = 0.5 m' --by cable.preload"),
    "line": ("static {} --case all --plot line.svg", "static {} --limits", "find {} limits --by cable.tension.value"),
    "section": (
        "static {} --case all --plot section.svg",
        "static {} --case hot --table cables --columns sag,clearance,inclination_from_plumb",
    ),
    "zipline": ("static {} --plot zipline.svg", "static {} --set cable.loads.0.fraction=0.25"),
    "footbridge": (
        "static {} --case all --table bodies",
        "modes {} -n 6",
        "static {} --case half --plot footbridge.svg",
    ),
    "gondola": ("windrms {} --plot wind.svg", "windrms {} --set cable.material=steel", "modes {} -n 6"),
    "suspension": ("static {} --plot suspension.svg", "modes {} -n 6", "static {} --table cables"),
    "study": ("sweep {} --dry-run", "sweep {} --plot study.svg"),
}
FREEZE_NOTE = "comments of the file are lost, base and changes are resolved"


@plain_command
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=PATH)
@SET
@FORMAT
@QUIET
def validate(files, sets, style, quiet):
    """Read and check scenes and studies; compute nothing."""
    from cablestudy.interface.reference import validate_table

    table, mistakes, notes = validate_table(files, sets)
    echo_notes(notes, quiet)
    for mistake in mistakes:
        click.echo(str(mistake), err=True)
    show(table, style)
    return WRONG_USE if mistakes else 0


@plain_command
@click.argument("kind", type=click.Choice(["scene", "suspension", "study"]))
def schema(kind):
    """JSON Schema of a file, for editors."""
    import json

    from cablestudy.interface.files import schema as schema_of

    write_utf8()
    click.echo(json.dumps(schema_of(kind), indent=2, ensure_ascii=False))


@plain_command
@click.argument("kind", type=click.Choice(["scene", "suspension", "study"]))
@click.argument("beginning", default="", metavar="[KEY]")
@FORMAT
def keys(kind, beginning, style):
    """Every key of a file, or those that begin with KEY: unit, default, meaning, what is allowed."""
    from cablestudy.interface.reference import key_table

    show(key_table(kind, beginning), style)


@plain_command
@click.argument("text", default="", metavar="[TEXT]")
@FORMAT
def columns(text, style):
    """Every column, or those with TEXT in their names: unit, meaning, needs."""
    from cablestudy.interface.reference import columns_table

    show(columns_table(text), style)


@plain_command
@click.argument("files", nargs=-1, metavar="[FILE...]", type=PATH)
@FORMAT
def materials(files, style):
    """Materials and ropes with their numbers and sources: of files of them, of scenes and studies, and built-in."""
    from cablestudy.interface.reference import materials_table

    show(materials_table(files), style)


@plain_command
@click.argument("kind", metavar="KIND", type=click.Choice(list(NEXT)))
@click.argument("file", required=False, metavar="[FILE]", type=PATH)
@QUIET
def new(kind, file, quiet):
    """Write a commented scene, or a study upon the guy, as FILE (default: KIND.yaml; - for standard output).

    KIND is guy, line, section, zipline, footbridge, gondola, suspension or study.

    A file that is there already is not overwritten.
    """
    if file == "":
        raise SceneError("cablestudy new: give the name of a file")
    from cablestudy.interface.files import template

    text = template(kind)
    if file == "-":
        click.echo(text, nl=False)
        return
    file, begun = file or f"{kind}.yaml", False
    try:
        with open(file, "x", encoding="utf-8") as stream:
            begun = True
            stream.write(text)
    except FileExistsError:
        raise SceneError(f"{file}: is there already; give another name") from None
    except OSError as error:
        if begun:
            os.unlink(file)
        raise SceneError(f"{file}: cannot be written ({error.strerror or error})") from None
    import shlex

    lines = [f"  cablestudy {words.format(shlex.quote(file))}" for words in NEXT[kind]]
    echo_notes([f"written: {file}; try", *lines], quiet)


def _is_same_file(name, other):
    """True for two names of one file that is there."""
    return os.path.exists(name) and os.path.exists(other) and os.path.samefile(name, other)


@plain_command
@SCENE
@SET
@click.option("--out", metavar="FILE", help="Where it goes, over what is there. Default, and -: standard output.")
@QUIET
def freeze(scene, sets, out, quiet):
    """Write the scene with its unstretched lengths in full, instead of the preloads, tensions and sags that give them.

    They are those of the reference state. Tables of the frozen scene are those of the scene.
    """
    from cablestudy.interface import read
    from cablestudy.interface.files import write_whole

    out = None if out == "-" else out
    loaded_scene = read(scene, sets, None)
    if out and any(_is_same_file(out, name) for name in loaded_scene.document.files):
        what = "is the scene itself" if _is_same_file(out, scene) else "is a file that the scene reads"
        raise SceneError(f"--out {out}: {what}, whose comments would be lost; give another name")
    heading = f"# {scene if scene.isprintable() else 'scene'}, with the unstretched lengths of its reference state\n"
    text = heading + loaded_scene.freeze()
    if out is None:
        click.echo(text, nl=False)
    else:
        write_whole(out, text)
    echo_notes([f"{f'written: {out}; ' if out else ''}{FREEZE_NOTE}"], quiet)
