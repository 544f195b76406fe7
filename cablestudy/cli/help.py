"""The commands: in which module each is, its line in the list, its examples; imported when they are first used.

The examples work on the files that `cablestudy new` writes.
"""

from difflib import get_close_matches
from importlib import import_module

import click

# Group -> command -> (its module in cli/, its line in the list, its examples).
GROUPS = {
    "Look at one scene": {
        "static": ("scene", "Tensions, sag, stiffness, reactions.", (
            "static guy.yaml --case all --plot guy.svg", "static zipline.yaml --locus load1 --plot path.svg",
            "static suspension.yaml --table cables")),
        "modes": ("scene", "Frequencies and shapes of the modes.", (
            "modes guy.yaml -n 6 --case ice", "modes suspension.yaml -n 6 --plot modes.svg --animate modes.gif")),
        "windrms": ("scene", "Motion in gusty wind, with and without the winch loop.", (
            "windrms gondola.yaml --plot wind.svg", "windrms gondola.yaml --set cable.material=steel")),
        "loop": ("scene", "Margins of the winch loop, over frequency and in time.", (
            "loop gondola.yaml --plot loop.svg", "loop gondola.yaml --time 60s --input gust --plot gust.svg")),
        "ssm": ("scene", "The state space for MATLAB, scipy and python-control.", (
            "ssm gondola.yaml --with gondola --out gondola.mat", "ssm gondola.yaml --response 0.1Hz:10Hz:50")),
        "report": ("scene", "A scene or a study as one page of HTML.", (
            "report guy.yaml --out guy.html", "report study.yaml")),
        "find": ("scene", "The value of a key for which a column takes a value.", (
            "find guy.yaml 'sag = 0.5 m' --by cable.preload", "find line.yaml limits --by cable.tension.value")),
        "trade": ("scene", "Error against time of every model, closed form to fine.", (
            "trade guy.yaml --columns sag --repeats 1",)),
    },
    "Studies": {
        "sweep": ("sweep", "Compute a study: one row for each case.", (
            "sweep study.yaml --plot study.svg", "sweep study.yaml --where 'sag < 0.7 m' --sort utilisation")),
        "show": ("sweep", "Show what is stored of a study; compute nothing.", (
            "sweep study.yaml", "show study.yaml --where 'sag < 0.7 m' --top 5")),
        "merge": ("sweep", "Join the shards of a study that ran on several machines.", (
            "sweep study.yaml --shard 1/2", "sweep study.yaml --shard 2/2", "merge study.yaml")),
    },
    "Files and reference": {
        "new": ("files", "Write a commented scene or study to begin with.", (
            "new guy", "new line my-line.yaml", "new study -")),
        "freeze": ("files", "A scene with its unstretched lengths in full.", (
            "freeze guy.yaml --out built.yaml", "freeze suspension.yaml")),
        "validate": ("files", "Check scenes and studies, compute nothing.", ("validate guy.yaml study.yaml",)),
        "keys": ("files", "Every key of a file: unit, default, meaning.", (
            "keys scene", "keys suspension tensions", "keys study --format csv")),
        "columns": ("files", "Every column: unit, meaning, what it needs.", ("columns sag", "columns --format csv")),
        "materials": ("files", "Materials and ropes with their numbers and sources.", (
            "materials", "materials guy.yaml --format csv")),
        "schema": ("files", "JSON Schema of a file, for editors.", ("schema scene > scene.schema.json",)),
    },
}  # fmt: skip
COMMANDS = {name: entry for group in GROUPS.values() for name, entry in group.items()}


def examples(name):
    """The examples of a command, each as it is typed."""
    return [f"cablestudy {words}" for words in COMMANDS[name][2]]


class Grouped(click.Group):
    """A group of commands that are listed as in `GROUPS`, and imported when they are first used."""

    def list_commands(self, ctx):
        return list(COMMANDS)

    def get_command(self, ctx, cmd_name):
        if cmd_name not in self.commands and cmd_name in COMMANDS:
            module, summary, _ = COMMANDS[cmd_name]
            command = getattr(import_module(f"cablestudy.cli.{module}"), cmd_name)
            command.short_help = summary
            # click shows a paragraph that begins with \b as it is written
            command.epilog = "\n".join(("\b", "Examples:", *(f"  {line}" for line in examples(cmd_name))))
            self.add_command(command)
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx, args):
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-"):
            near = get_close_matches(name, self.list_commands(ctx), 1)
            if near:
                ctx.fail(f"No such command {name!r}: did you mean {near[0]}?")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx, formatter):
        for title, group in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, summary) for name, (_, summary, _) in group.items()])
