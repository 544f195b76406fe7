"""The command freeze."""

import os

import click

from cablestudy.cli.error_handling import echo_notes, handle_errors
from cablestudy.cli.options import QUIET, SCENE, SET
from cablestudy.errors import SceneError

TOLD = "comments of the file are lost, base and changes are resolved"


@click.command()
@SCENE
@SET
@click.option("--out", metavar="FILE", help="Where it goes, over what is there. Default: standard output.")
@QUIET
@handle_errors
def freeze(scene, sets, out, quiet):
    """Write the scene with its unstretched lengths in full, instead of the preloads, tensions and sags that give them.

    They are those of the reference state. Tables of the frozen scene are those of the scene.
    """
    from cablestudy.interface import read
    from cablestudy.interface.output import write_whole

    if out and os.path.exists(out) and os.path.exists(scene) and os.path.samefile(out, scene):
        raise SceneError(f"--out {out}: is the scene itself, whose comments would be lost; give another name")
    heading = f"# {scene if scene.isprintable() else 'scene'}, with the unstretched lengths of its reference state\n"
    text = heading + read(scene, sets, None).freeze()
    if out is None:
        click.echo(text, nl=False)
    else:
        write_whole(out, text)
    echo_notes([f"{f'written: {out}; ' if out else ''}{TOLD}"], quiet)
