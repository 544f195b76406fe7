"""Results that cases share: one that depends on some keys of the scene only serves every case with equal keys."""

from cablestudy.study.tolerances import STUDY

PLAIN = (float, int, str)


class Cache:
    """Results by cable and key; those of the cables used longest ago are dropped."""

    def __init__(self):
        self._cables = {}

    def __contains__(self, where):
        cable, key = where
        return key in self._cables.get(cable, ())

    def results(self, cable, size):
        """The results of a cable, which becomes the one used last: dict.

        Parameters
        ----------
        cable : hashable
            What the cable depends on.
        size : int
            Numbers in the model: large models are not kept long.
        """
        results = self._cables.pop(cable, {})
        self._cables[cable] = results
        while len(self._cables) > max(2, min(STUDY.cached_cables, STUDY.cached_numbers // max(size, 1))):
            del self._cables[next(iter(self._cables))]
        return results


def shared(*keys):
    """A property of a `Case`, kept in `Case.known` and shared by cases whose cable and keys are equal.

    Parameters
    ----------
    keys : str
        Dotted keys of the scene on which the result depends, beside the cable and the refinement level.
    """

    def wrap(function):
        name = function.__name__

        def get(case):
            if name not in case.known:
                cable, key = case.key_of(name, keys)
                results = case.cache.results(cable, case.size)
                if key not in results:
                    results[key] = function(case)
                case.known[name] = results[key]
            return case.known[name]

        def put(case, result):
            case.known[name] = result

        return property(get, put, doc=function.__doc__)

    return wrap


def frozen(value):
    """A part of the scene, or a tuple of them, as plain tuples that can be compared and hashed."""
    if value is None or isinstance(value, PLAIN):
        return value
    return tuple(map(frozen, value if isinstance(value, tuple | list) else value.__dict__.values()))
