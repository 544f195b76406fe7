"""The option `--case`: one of the load cases of a scene, or all of them in one table."""

import click

from cablestudy.errors import SceneError

ALL = "all"
CASE = click.option("--case", metavar="NAME", help="One of the load cases of the scene, or all.")


def one_case(name, why):
    """Refuse `--case all` in a command that takes one case, and say why."""
    if name == ALL:
        raise SceneError(f"--case {ALL}: {why}")
