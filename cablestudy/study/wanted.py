"""The columns of a study, by what they need: asked of every row, told once."""

from cablestudy.study.columns import value

CLOSED = ("scene", "statics", "stiffness")
DISCRETE = ("modes", "gondola", "loop", "wind")


class Wanted:
    """Columns, by what they need.

    Parameters
    ----------
    columns : sequence of Column

    Attributes
    ----------
    physical : list of Column
        All but those that tell of the computation.
    closed : list of Column
        Those in closed form that are computed for many scenes at once.
    single : list of Column
        Those in closed form, or of the scene, that are computed case by case.
    keyed : list of Column
        The physical ones that need a key of the scene.
    motion : list of Column
        The physical ones that need the cable's motion.
    named : list of str
        Headers of the frequencies of cable modes.
    waves, sagging, axial : int
        Most half-waves that these have along a taut cable, and along one that sags; the largest number of an axial
        one. 0 without any.
    body, damped : bool
        Whether the motion is that of the gondola too; whether damping matters.
    scene_only : bool
        Whether not even the cable's equilibrium is needed.
    exact : dict
        Header -> relative error of a closed form.
    empty : dict
        Header of every column -> None.
    estimate, timed, clock : bool
        Whether errors are asked for; degrees of freedom, time or errors; the time.
    """

    def __init__(self, columns):
        self.physical = [column for column in columns if column.needs != "run"]
        self.closed = [column for column in self.physical if column.needs in CLOSED and not column.each]
        self.motion = [column for column in self.physical if column.needs in DISCRETE]
        self.body = any(column.needs in ("gondola", "loop", "wind") for column in self.motion)
        self.damped = any(column.needs in ("loop", "wind") for column in self.motion)
        self.single = [column for column in self.physical if column.each and column.needs in CLOSED]
        self.keyed = [column for column in self.physical if column.key]
        inside = [column for column in self.motion if column.mode and column.mode[1] != "out-of-plane"]
        outside = [column for column in self.motion if column.mode and column.mode[1] == "out-of-plane"]
        self._modes = tuple(tuple(column.mode for column in part) for part in (inside, outside))
        self.named = [column.header for column in (*inside, *outside)]
        waves = [(2 * number - 1, 2) if symmetry else (number, 1) for number, _, symmetry in sum(self._modes, ())]
        self.waves = max((taut for taut, _ in waves), default=0)
        self.sagging = max((taut + more for taut, more in waves[: len(inside)]), default=0)
        self.axial = max((column.mode[0] for column in inside if column.mode[1] == "axial"), default=0)
        self._others = [column for column in self.motion if not column.mode]
        self.scene_only = all(column.needs == "scene" for column in self.physical)
        self.estimate = any(column.name == "error_estimate" for column in columns)
        self.exact = {c.header: c.least_error for c in self.physical if c.least_error is not None}
        self.empty = dict.fromkeys(column.header for column in columns)
        self.timed = any(column.needs == "run" and column.name != "status" for column in columns)
        self.clock = any(column.name == "solve_time" for column in columns)

    def sample(self, case):
        """Numbers of the columns that need motion, and errors of those that tell it: as `climb` takes them."""
        frequencies, errors = case.frequencies(self._modes)
        numbers = dict(zip(self.named, frequencies, strict=True))
        numbers.update((column.header, value(column, case)) for column in self._others)
        return numbers, dict(zip(self.named, errors, strict=True))
