"""The Python interface: what the commands do, as functions that return mappings, data frames, models and figures.

    import cablestudy as cs
    scene = cs.load("carlina.yaml", set={"cable.diameter": "3.7 mm"})
    scene.static()["sag_m"]

Names and errors are those of the command line: a mistake of the user raises `SceneError`, a case without an answer has
empty cells and says why in `status`, or raises `NoSolutionError` or `ConvergenceError` where nothing can be had.
"""

import json

from cablestudy.errors import SceneError
from cablestudy.scene.scene import each_case, load_scene
from cablestudy.scene.suspension import SuspensionScene

KINDS = ("static", "modes", "windrms")


class Values(dict):
    """Name with unit -> number, as one row of a table: `values["sag_m"]`.

    Attributes
    ----------
    units : dict
        Name -> unit.
    errors : dict
        Name -> estimated relative error, where it is known.
    warnings : tuple of str
    """

    def __init__(self, table, warnings=()):
        (row,) = table.rows
        super().__init__((field.name, row.get(field.name)) for field in table.fields)
        self.units = {field.name: field.unit for field in table.fields}
        self.errors = next(iter(table.errors()), {}) if table.errors else {}
        self.warnings = tuple(warnings)


def frame_of(table):
    """A `Table` as a pandas.DataFrame; `attrs["units"]` has the unit of each column."""
    import pandas

    names = [field.name for field in table.fields]
    frame = pandas.DataFrame([[row.get(name) for name in names] for row in table.rows], columns=names)
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame


def _texts(changes):
    """Key -> value, as the texts KEY=VALUE that files are changed by."""
    return tuple(f"{key}={json.dumps(value, ensure_ascii=False)}" for key, value in (changes or {}).items())


def load(path, set=None, case=None):
    """Read a scene file.

    Parameters
    ----------
    path : str or path-like
    set : dict, optional
        Dotted key -> value that changes the file: a number in SI, or text with a unit.
    case : str, optional
        One of the load cases of the scene.

    Returns
    -------
    Scene or Suspension

    Raises
    ------
    SceneError
        All that is wrong with it.
    """
    changes = _texts(set) + _texts({} if case is None else {"case": case})
    document, model = load_scene(path, changes, suspensions=True)
    kind = Suspension if isinstance(model, SuspensionScene) else Scene
    return kind(document, model)


class Scene:
    """A scene of one cable.

    Attributes
    ----------
    document : Document
        What was written, with places.
    model : scene.Scene
        The same in SI.
    """

    def __init__(self, document, model):
        self.document, self.model = document, model

    @property
    def cases(self):
        """The scene in each of its load cases: dict of name -> Scene."""
        return {name: type(self)(*of_case) for name, *of_case in each_case(self.document, self.model)}

    def static(self):
        """Tension, sag, end stiffness and more: `Values`."""
        from cablestudy.study.report import static_table

        table, row = static_table(self.model, estimate=True)
        return Values(table, row.warnings)

    def shape(self):
        """The static shape, point by point: pandas.DataFrame."""
        from cablestudy.study.case import Case
        from cablestudy.study.report import shape_table

        return frame_of(shape_table(Case(self.model)))

    def modes(self, count=None, upto=None):
        """The modes with fixed ends: pandas.DataFrame.

        Parameters
        ----------
        count : int, optional
            How many, from the lowest; 12 where nothing is given.
        upto : float, optional
            All up to this frequency instead. [Hz]
        """
        from cablestudy.study.report import mode_table

        case, found = self._modes(count, upto)
        return frame_of(mode_table(case, found))

    def _modes(self, count, upto):
        from cablestudy.study import case_modes
        from cablestudy.study.case import Case

        if count is not None and upto is not None:
            raise SceneError("count and upto exclude each other")
        return case_modes.modes(Case(self.model), count or 12, upto)[:2]

    def windrms(self, on=None):
        """The gondola in the wind, or a bare cable: `Values`.

        Parameters
        ----------
        on : {"gondola", "cable", "both"}, optional
            What the wind acts on; by default the gondola where there is one.
        """
        return self._wind(on)[0]

    def _wind(self, on):
        from cablestudy.study.wind_report import wind_table

        table, row, remarks = wind_table(self.document, self.model, on, estimate=True)
        return Values(table, (*row.warnings, *remarks)), row

    def state_space(self, with_=None, modes=None, upto=None, error=None, wind=False):
        """The cable as a linear system of first order: `control.statespace.StateSpace`.

        Parameters
        ----------
        with_ : {"gondola", "loop"}, optional
            What is on end 2; of a suspension "loop" or "actuators".
        modes : int, optional
            How many to keep, from the lowest.
        upto : str, optional
            Keep all up to a frequency instead, for example "20 Hz".
        error : float, optional
            Keep the fewest that leave out this share of the inertia. [-]
        wind : bool
            Whether forces on the nodes of the cable are inputs too.
        """
        from cablestudy.study import ssm

        options = ssm.Options(count=modes, upto=upto, error=error, attached=with_, wind=wind)
        return self._choose(options).system()

    def _choose(self, options):
        from cablestudy.study import ssm

        return ssm.choose(self.document, self.model, options)

    def find(self, goal, by, between=None, columns=None):
        """The values of a key for which a column takes a value: pandas.DataFrame, one row for each.

        Parameters
        ----------
        goal : str
            For example "sag = 2 m".
        by : str
            The key, for example "cable.preload".
        between : str, optional
            Its range, for example "100 N:10 kN".
        columns : str, optional
            Columns beside it, separated by commas.
        """
        from cablestudy.study import find
        from cablestudy.study.goal import read_find, read_goal

        asked = read_goal(*read_find(goal, by, between), self.document)
        shown = find.shown_columns(asked, self.document, columns)
        table, _ = find.find_table(asked, find.solve(asked, self.document), shown)
        return frame_of(table)

    def trade(self, columns=None, repeats=5):
        """Error against time of every model: pandas.DataFrame.

        Parameters
        ----------
        columns : str, optional
            What to compare, separated by commas.
        repeats : int
            Of each timing.
        """
        from cablestudy.study import trade

        compared, _ = trade.columns_to_compare(self.document, self.model, columns)
        return frame_of(trade.table_of(trade.compare(self.model, compared, repeats)))

    def plot(self, kind="static"):
        """A picture: matplotlib.figure.Figure.

        Parameters
        ----------
        kind : {"static", "modes", "windrms"}
        """
        if kind not in KINDS:
            raise SceneError(f"plot: unknown kind {kind!r} (allowed: {', '.join(KINDS)})")
        from cablestudy.study import plots

        return self._draw(plots, kind)

    def _draw(self, plots, kind):
        if kind == "modes":
            return plots.mode_shapes(*self._modes(None, None))
        if kind == "windrms":
            return plots.wind_response(self._wind(None)[1].case, "gondola")
        from cablestudy.study.case import Case

        return plots.static_form(Case(self.model))


class Suspension(Scene):
    """A scene of several cables, bodies and points; its tables are mappings of name -> pandas.DataFrame."""

    def __init__(self, document, model):
        super().__init__(document, model)
        self._case = None

    @property
    def case(self):
        """Its equilibrium and motion, each computed when it is first asked for: `SuspensionCase`."""
        from cablestudy.study.suspension.case import SuspensionCase

        if self._case is None:
            self._case = SuspensionCase(self.model)
        return self._case

    def static(self):
        """The tables bodies, points, cables and stiffness."""
        from cablestudy.study.suspension.report import static_tables

        return {name: frame_of(table) for name, table in static_tables(self.case).items()}

    def shape(self):
        """Not there: the tables of `static` have the places of bodies and points."""
        raise SceneError("shape: the scene is a suspension; see the tables of static()")

    def modes(self, count=None, upto=None):
        """Its coupled modes; parameters as of `Scene.modes`."""
        from cablestudy.study.suspension.report import mode_table

        case, found = self._modes(count, upto)
        return frame_of(mode_table(case, found, range(len(found)) if upto is None else found.up_to(upto)))

    def _modes(self, count, upto):
        if count is not None and upto is not None:
            raise SceneError("count and upto exclude each other")
        return self.case, self.case.modes(count or 12) if upto is None else self.case.modes_up_to(upto)

    def windrms(self, on=None):
        """The tables motion, rotations, open_loop, cables, actuators, loop and coordinates."""
        from cablestudy.study.suspension.wind_report import wind_tables

        if on is not None:
            raise SceneError("on: the scene is a suspension, whose key wind.on says so")
        return {name: frame_of(table) for name, table in wind_tables(self.document, self.case).items()}

    def _choose(self, options):
        from cablestudy.study.suspension import ssm

        return ssm.choose(self.document, self.model, options)

    def _draw(self, plots, kind):
        if kind == "modes":
            case, found = self._modes(None, None)
            return plots.suspension_modes(case, found, len(found))
        return plots.suspension_wind(self.case) if kind == "windrms" else plots.suspension_views(self.case)


def sweep(study, set=None, vary=None, jobs=None, out=None):
    """Compute a study.

    Parameters
    ----------
    study : str or path-like
    set : dict, optional
        Dotted key -> value that changes the base.
    vary : dict, optional
        Dotted key -> text of values, as of the option `--vary`: "100N:2kN:20log", "10kg,50kg".
    jobs : int, optional
        Processes; by default as many as the work is worth.
    out : str, optional
        Folder in which the rows are kept, and the files of the study written, as `cablestudy sweep --out` does; by
        default nothing is written.

    Returns
    -------
    pandas.DataFrame
        One row for each case, with the names and numbers of the CSV. `attrs["units"]` has the unit of each column.

    Raises
    ------
    SceneError
        All that is wrong with the study.
    """
    from cablestudy.scene.study import read_study
    from cablestudy.study.table import TableFiles
    from cablestudy.sweeps.run import Options, Run

    texts = tuple(f"{key}={text}" for key, text in (vary or {}).items())
    asked = read_study(study, _texts(set), texts)
    files = TableFiles("results" if out is None else str(out), asked.name)
    keep = out is not None
    if keep:
        files.check_writable()
    with Run(asked, files, Options(keep=keep, jobs=jobs, quiet=True, resume=False)) as work:
        work.compute()
        work.check_complete()
        table = work.table()
        if keep:
            work.write(table, "cablestudy.sweep")
        frame = table.rows.frame()[[field.name for field in table.fields]]
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame


def trade(path, columns=None, repeats=5, set=None):
    """Error against time of every model for a scene; see `Scene.trade`."""
    return load(path, set).trade(columns, repeats)


def find(path, goal, by, between=None, columns=None, set=None, case=None):
    """The values of a key for which a column of a scene takes a value; see `Scene.find`."""
    return load(path, set, case).find(goal, by, between, columns)
