"""Parameter studies of actively controlled suspended cables.

`load` reads a scene, `sweep` computes a study, `find` and `trade` are the commands of these names; see `interface`.
"""

__version__ = "0.2.0"
ERRORS = ("CablestudyError", "SceneError", "NoSolutionError", "ConvergenceError")
__all__ = ["Scene", "Suspension", "find", "load", "sweep", "trade", *ERRORS]


def __getattr__(name):
    """The names of `__all__`, imported when they are first asked for: `import cablestudy` alone costs nothing."""
    if name not in __all__:
        raise AttributeError(f"module 'cablestudy' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("cablestudy.errors" if name in ERRORS else "cablestudy.interface"), name)
