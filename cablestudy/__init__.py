"""Parameter studies of actively controlled suspended cables.

`load` reads a scene, `sweep` computes a study; `find`, `trade` and `report` are the commands of these names; see
`interface`.
"""

from cablestudy.version import __version__ as __version__

TYPE_CHECKING = False  # type checkers take it for true; typing is not imported, so that Ctrl-C finds its handler early
if TYPE_CHECKING:
    from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError, SceneError
    from cablestudy.interface import Scene, Suspension, find, load, sweep, trade
    from cablestudy.pages.report import report

ERRORS = ("CablestudyError", "SceneError", "NoSolutionError", "ConvergenceError")
__all__ = [
    "CablestudyError",
    "ConvergenceError",
    "NoSolutionError",
    "Scene",
    "SceneError",
    "Suspension",
    "find",
    "load",
    "report",
    "sweep",
    "trade",
]
ELSEWHERE = {**dict.fromkeys(ERRORS, "cablestudy.errors"), "report": "cablestudy.pages.report"}


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


def __getattr__(name: str) -> object:
    """The names of `__all__`, imported when they are first asked for: `import cablestudy` alone costs nothing."""
    if name not in __all__:
        raise AttributeError(f"module 'cablestudy' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(ELSEWHERE.get(name, "cablestudy.interface")), name)
