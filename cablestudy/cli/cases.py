"""The option `--case`: one of the load cases of a scene, or all of them in one table."""

import click

from cablestudy.errors import SceneError

ALL = "all"
CASE_HELP = "One of the load cases of the scene"
CASE = click.option("--case", metavar="NAME", help=f"{CASE_HELP}, or all.")
ONE_CASE = click.option("--case", metavar="NAME", help=f"{CASE_HELP}.")


def one_case(name, why):
    """Refuse `--case all` in a command that takes one case, and say why."""
    if name == ALL:
        raise SceneError(f"--case {ALL}: {why}")
