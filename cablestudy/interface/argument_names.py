"""Messages about options, for callers from Python: the names of arguments in the place of those of options."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from cablestudy.errors import Mistake, NoSolutionError, SceneError

RENAMED = {"with": "with_"}
_COMMAND_OR_OPTION = re.compile(r"'cablestudy[^']*'|(?<![\w-])--([a-z]+(?:-[a-z]+)*)")


@contextmanager
def argument_names() -> Iterator[None]:
    """Let errors name arguments, `input` for `--input`; commands in quotes stay as they are typed."""
    try:
        yield
    except SceneError as error:
        changed = [Mistake(in_python(one.where), one.key, in_python(one.message)) for one in error.mistakes]
        raise SceneError(*changed) from None
    except NoSolutionError as error:
        raise NoSolutionError(in_python(str(error))) from None


def in_python(text: str) -> str:
    """A message with the names of arguments."""

    def named(match: re.Match[str]) -> str:
        option = match[1]
        return match[0] if option is None else RENAMED.get(option, option.replace("-", "_"))

    return _COMMAND_OR_OPTION.sub(named, text)
