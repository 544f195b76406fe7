"""The command new: a commented file to begin with."""

import click

from cablestudy.cli.error_handling import echo_notes, handle_errors
from cablestudy.cli.options import PATH, QUIET
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


@click.command()
@click.argument("kind", type=click.Choice(list(NEXT)))
@click.argument("file", required=False, metavar="[FILE]", type=PATH)
@QUIET
@handle_errors
def new(kind, file, quiet):
    """Write a commented scene, or a study upon the guy, as FILE (default: KIND.yaml; - for standard output).

    A file that is there already is not overwritten.
    """
    if file == "":
        raise SceneError("cablestudy new: give the name of a file")
    from cablestudy.interface.files import template

    text = template(kind)
    if file == "-":
        click.echo(text, nl=False)
        return
    file = file or f"{kind}.yaml"
    try:
        with open(file, "x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise SceneError(f"{file}: is there already; give another name") from None
    except OSError as error:
        raise SceneError(f"{file}: cannot be written ({error.strerror or error})") from None
    import shlex

    lines = [f"  cablestudy {words.format(shlex.quote(file))}" for words in NEXT[kind]]
    echo_notes([f"written: {file}; try", *lines], quiet)
