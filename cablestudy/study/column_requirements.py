"""What the columns of a study need, found once for all of its rows."""

from functools import cached_property

from cablestudy.errors import CablestudyError
from cablestudy.study.columns import value

CLOSED = ("scene", "statics", "stiffness")
DISCRETE = ("modes", "gondola", "loop", "wind")


class ColumnRequirements:
    """Columns by what they need.

    Parameters
    ----------
    columns : sequence of Column

    Attributes
    ----------
    physical : list of Column
        All but those that describe the computation.
    closed, single, motion : list of Column
        The physical ones that are closed forms of many cases at once; closed forms computed case by case; that need
        the cable's motion.
    of_equilibrium : list of str
        Headers of the physical ones that need more than the scene.
    gondola, damped : bool
        Whether the motion is that of the gondola too; whether damping matters.
    scene_only : bool
        Whether no column needs the cable's equilibrium.
    least_errors : dict
        Header -> relative error of a closed form, by rounding.
    empty : dict
        Header of every column -> None.
    estimate, run, clock : bool
        Whether errors are a column; whether any column describes the computation; whether the time is one.
    """

    def __init__(self, columns):
        self.physical = [column for column in columns if column.needs != "run"]
        self.of_equilibrium = [column.header for column in self.physical if column.needs != "scene"]
        closed = _needing(self.physical, *CLOSED)
        self.closed = [column for column in closed if not column.each]
        self.single = [column for column in closed if column.each]
        self.motion = _needing(self.physical, *DISCRETE)
        self.gondola = bool(_needing(self.motion, "gondola", "loop", "wind"))
        self.damped = bool(_needing(self.motion, "loop", "wind"))
        self.scene_only = not self.of_equilibrium
        self.least_errors = {c.header: c.least_error for c in self.physical if c.least_error is not None}
        self.empty = {column.header: None for column in columns}
        names = {column.name for column in columns if column.needs == "run"}
        self.estimate, self.clock, self.run = "error_estimate" in names, "solve_time" in names, bool(names - {"status"})
        self.modes = [column for column in self.motion if column.mode]
        self._planes = _by_plane(self.modes)

    @cached_property
    def waves(self):
        """Most half-waves that the modes have along a taut cable, 0 without modes. [-]"""
        return max((_half_waves(column) for column in self.modes), default=0)

    @cached_property
    def sagging_waves(self):
        """The same of the in-plane modes of a cable that sags: up to two half-waves more. [-]"""
        return max((_half_waves(column) + (2 if column.mode[2] else 1) for column in self._planes[0]), default=0)

    @cached_property
    def axial(self):
        """Largest number of an axial mode, 0 without one."""
        return max((column.mode[0] for column in self.modes if column.mode[1] == "axial"), default=0)

    def sample(self, case, refused=()):
        """Values of the columns that need motion, at one level of refinement.

        Parameters
        ----------
        case : Case
        refused : container of str
            Headers of columns that are left out.

        Returns
        -------
        values : dict
            Header -> number or None.
        errors : dict
            Header -> estimated relative error, of frequencies of modes, which a single model gives.
        failures : dict
            Header -> CablestudyError of a column that cannot be had.
        """
        planes = self._planes
        if refused:
            planes = _by_plane([column for column in self.modes if column.header not in refused])
        values, errors, failures = _frequencies(case, planes)
        for column in self.motion:
            if column.mode or column.header in refused:
                continue
            try:
                values[column.header] = value(column, case)
            except CablestudyError as error:
                failures[column.header] = error
        return values, errors, failures


def _frequencies(case, planes):
    """As `ColumnRequirements.sample`, of columns of modes by plane: in one call, or one by one where one is missing."""
    columns = planes[0] + planes[1]
    if not columns:
        return {}, {}, {}
    try:
        found, errors = case.frequencies(tuple(tuple([column.mode for column in plane]) for plane in planes))
    except CablestudyError as error:
        if len(columns) == 1:
            return {}, {}, {columns[0].header: error}
        parts = [_frequencies(case, _by_plane([column])) for column in columns]
        return tuple({header: entry for part in parts for header, entry in part[k].items()} for k in range(3))
    headers = [column.header for column in columns]
    return dict(zip(headers, found, strict=True)), dict(zip(headers, errors, strict=True)), {}


def _by_plane(columns):
    """Columns of modes in the plane, and of those out of plane: two lists."""
    across = [column for column in columns if column.mode[1] == "out-of-plane"]
    return [column for column in columns if column not in across], across


def _half_waves(column):
    """Half-waves of a mode along a taut cable. [-]"""
    number, _, symmetry = column.mode
    return 2 * number - 1 if symmetry else number


def _needing(columns, *needs):
    return [column for column in columns if column.needs in needs]
