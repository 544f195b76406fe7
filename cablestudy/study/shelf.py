"""What cases share: a part of one that depends on some keys only serves every other with equal keys."""

from functools import cached_property

ROOM = 256  # cables whose parts are kept
NUMBERS = 4_000_000  # in all of them together, about
PLAIN = (float, int, str)


class Shelf:
    """Parts of earlier cases, those of the cables used longest ago given up first."""

    def __init__(self):
        self._cables = {}

    def get(self, cable, key, size, compute):
        """A part, computed when it is not there.

        Parameters
        ----------
        cable, key : hashable
            What the cable, and what the part of it depends on.
        size : int
            Of its model, in numbers: large ones are not kept long.
        compute : callable
            Without arguments.
        """
        parts = self._newest(cable, size)
        if key not in parts:
            parts[key] = compute()
        return parts[key]

    def put(self, cable, key, size, part):
        """Keep a part that was computed elsewhere."""
        self._newest(cable, size)[key] = part

    def __contains__(self, where):
        cable, key = where
        return key in self._cables.get(cable, ())

    def _newest(self, cable, size):
        """The parts of a cable that is now the one used last."""
        parts = self._cables.pop(cable, {})
        self._cables[cable] = parts
        while len(self._cables) > max(2, min(ROOM, NUMBERS // max(size, 1))):
            del self._cables[next(iter(self._cables))]
        return parts


def part_key(case, name, *values):
    """(cable, key) of a part of a case on its shelf."""
    return case.cable_key, (name, case.rung, *values)


def key_of(case, name):
    """The same of a part that is `shared`."""
    return part_key(case, name, *(getattr(case, key) for key in getattr(type(case), name).func.keys))


def shared(*keys):
    """A property of a `Case` that cases on one shelf share where the cable and these keys are equal.

    Parameters
    ----------
    keys : str
        Names of methods of the case that give what else, beside the cable, the part depends on.
    """

    def wrap(function):
        def get(case):
            cable, key = part_key(case, function.__name__, *(getattr(case, name) for name in keys))
            return case.shelf.get(cable, key, case.size, lambda: function(case))

        get.keys, get.__doc__ = keys, function.__doc__
        return cached_property(get)

    return wrap


def frozen(value):
    """A model of the scene, or a tuple of them, as plain tuples that can be compared and hashed."""
    if value is None or isinstance(value, PLAIN):
        return value
    return tuple(map(frozen, value if isinstance(value, tuple | list) else value.__dict__.values()))
