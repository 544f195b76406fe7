"""Results that cases share: a result that depends on a few keys of the scene serves every case with equal keys."""

from cablestudy.study.tolerances import STUDY

PLAIN = (float, int, str)


class Cache:
    """Results of cables: cable -> (name of the result, values of keys) -> result; `shared` fills it.

    To bound the memory, the results of the cables that were used longest ago are dropped.
    """

    def __init__(self):
        self._cables = {}

    def __contains__(self, cable_and_key):
        cable, key = cable_and_key
        return key in self._cables.get(cable, ())

    def results(self, cable, size):
        """Stored results of a cable, which becomes the one used last: dict.

        Parameters
        ----------
        cable : hashable
            All values of the scene on which the cable depends.
        size : int
            Numbers in the model: large models are not kept long.
        """
        results = self._cables.pop(cable, {})
        self._cables[cable] = results
        while len(self._cables) > max(2, min(STUDY.cached_cables, STUDY.cached_numbers // max(size, 1))):
            del self._cables[next(iter(self._cables))]
        return results


def shared(*keys):
    """Decorator that makes a method of `Case` a property which is computed once, also for several cases.

    The result is kept in the case (`Case.computed`), and in the cache, from which every case takes it that has the same
    cable, refinement level and values of the keys. It may be set, too, where it is computed for many cases at once.

    Parameters
    ----------
    keys : str
        Dotted keys of the scene on which the result depends, beside the cable and the refinement level.
    """

    def as_property(function):
        name = function.__name__

        def get_result(case):
            if name not in case.computed:
                cable, key = case.key_of(name, keys)
                results = case.cache.results(cable, case.size)
                if key not in results:
                    results[key] = function(case)
                case.computed[name] = results[key]
            return case.computed[name]

        def set_result(case, result):
            case.computed[name] = result

        return property(get_result, set_result, doc=function.__doc__)

    return as_property


def frozen(value):
    """A table of the scene, or a tuple of tables, as nested tuples of plain values that can be compared and hashed."""
    if value is None or isinstance(value, PLAIN):
        return value
    parts = value if isinstance(value, (tuple, list)) else value.__dict__.values()
    return tuple([part if part is None or isinstance(part, PLAIN) else frozen(part) for part in parts])
