"""A scene of one cable as users of Python have it: a method for each command."""

from __future__ import annotations

import warnings
from collections.abc import Set
from typing import TYPE_CHECKING, ClassVar, Self

from cablestudy.activity import ActivityDisplay
from cablestudy.errors import SceneError, shorten
from cablestudy.interface.arguments import checked
from cablestudy.interface.kinds import (
    Between,
    Columns,
    Duration,
    Frequencies,
    Frequency,
    Goal,
    Modes,
    Number,
    Picture,
    Runs,
    Size,
    Text,
    Texts,
    WindOn,
)
from cablestudy.interface.scene_commands import SceneCommands
from cablestudy.scene.document import Document
from cablestudy.scene.fields import KeyTable
from cablestudy.scene.scene import each_case

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cablestudy.control.statespace import StateSpace
    from cablestudy.interface.answer import Values


TABLES = ("cable", "gondola", "winch", "wind", "cases")
NAMED = 120  # characters of path and changes in a representation


class Scene(SceneCommands):
    """A scene of one cable, as `load` returns it.

    Attributes
    ----------
    path : str
        Of its file.
    changes : tuple of str
        What was changed in it, as KEY=VALUE.
    model : scene.CableScene
        What was written, in SI.
    """

    hidden: ClassVar[Set[str]] = {*vars(SceneCommands), "document", "hidden"}  # names that no user needs

    @checked
    def __init__(self, path: Text, changes: Texts, document: Document, model: KeyTable) -> None:
        self.path, self.changes, self.document, self.model = path, changes, document, model

    def __dir__(self) -> list[str]:
        """Names that a user calls and reads: list of str."""
        names = {*vars(self), *(name for kind in type(self).__mro__[:-1] for name in vars(kind))}
        return sorted(name for name in names - self.hidden if not name.startswith("_"))

    def __repr__(self) -> str:
        listed = ", ".join((self.path, *self.changes))
        return f"{type(self).__name__}({shorten(listed, NAMED)}: {self._contents})"

    @property
    def _contents(self) -> str:
        """The tables of the scene, for its representation."""
        return ", ".join(name for name in TABLES if getattr(self.model, name))

    @property
    def cases(self) -> dict[str, Self]:
        """The scene in each of its load cases: dict of name -> Scene."""
        cases = each_case(self.document, self.model)
        return {name: type(self)(self.path, self.changes, document, model) for name, document, model in cases}

    @checked
    def static(self) -> Values:
        """Tension, sag, end stiffness and more: `Values`."""
        return self.compute("static", estimate=True).values()

    @checked
    def shape(self) -> pandas.DataFrame:
        """The static shape, point by point: pandas.DataFrame."""
        return self.compute("shape").frame()

    @checked
    def limits(self) -> pandas.DataFrame:
        """Each limit of the scene where its margin is least, in all of its load cases: pandas.DataFrame."""
        return self.compute("limits").frame()

    @checked
    def loads(self) -> pandas.DataFrame:
        """Place, sag, clearance, slopes and tensions at each point load: pandas.DataFrame."""
        return self.compute("loads").frame()

    @checked
    def locus(self, load: Text) -> pandas.DataFrame:
        """The path of a point load that travels from end to end, unstretched lengths fixed: pandas.DataFrame.

        Parameters
        ----------
        load : str
            Its name, "load1", of a suspension "CABLE.load1", and after a colon how many places: "load1:99".
        """
        return self.compute("locus", load=load).frame()

    @checked
    def modes(
        self,
        count: Modes | None = None,
        upto: Frequency | None = None,
        coupled: bool = False,
        cable: Text | None = None,
    ) -> pandas.DataFrame:
        """The modes with fixed ends: pandas.DataFrame.

        Parameters
        ----------
        count : int, optional
            How many, from the lowest; 12 where nothing is given.
        upto : float or str, optional
            All up to this frequency instead, in Hz or with a unit.
        coupled : bool
            Those of gondola and cable together instead, as for a suspension.
        cable : str, optional
            "cable", the name of the only one: its modes, as by default.
        """
        return self.compute("modes", count=count, upto=upto, coupled=coupled, cable=cable).frame()

    @checked
    def windrms(self, on: WindOn | None = None) -> Values:
        """The gondola in the wind, or a bare cable: `Values`.

        Parameters
        ----------
        on : {"gondola", "cable", "both"}, optional
            What the wind acts on; by default the gondola where there is one.
        """
        return self.compute("windrms", on=on, estimate=True).values()

    @checked
    def loop(self) -> Values:
        """Margins, sensitivity and bandwidth of the winch loop: `Values`."""
        return self.compute("loop", estimate=True).values()

    @checked
    def loop_response(self, response: Frequencies) -> pandas.DataFrame:
        """The loop over frequency: pandas.DataFrame.

        Parameters
        ----------
        response : str or sequence of 3
            Range and number of frequencies, for example "0.01Hz:100Hz:200" or (0.01, 100, 200).
        """
        return self.compute("loop", response=response).frame()

    @checked
    def loop_in_time(
        self,
        time: Duration,
        input: Text | None = None,
        size: Size | None = None,
        length: Duration | None = None,
        output: Text | None = None,
    ) -> pandas.DataFrame:
        """Response of the winch control loop in time to a step or gust: pandas.DataFrame, one row for each time.

        Parameters
        ----------
        time : float or str
            Duration in s or with a unit, perhaps with the number of rows: 60, "60 s", "60 s:2001".
        input : str, optional
            Input of the loop:

            - "winch" (the default): a step of the displacement by the winch; of a suspension "winch.CABLE".
            - "reference": a step of the wanted position; of a suspension "reference.x" or of another coordinate.
            - "gust": a gust of the wind speed, size/2 (1 - cos(2 pi t/length)) until t = length.
            - "wind": a step of the wind speed.
        size : float or str, optional
            Size of the input, in SI or with a unit; by default a step of 1 mm (a rotation of 1 mrad), in the wind 3
            standard deviations of the turbulence.
        length : float or str, optional
            Time that a gust lasts, in s or with a unit; by default length scale of the turbulence over wind speed.
        output : str, optional
            The coordinate of a body that is shown, for example "gondola.x"; of one cable there is no other.
        """
        timed = {"input": input, "size": size, "length": length, "output": output}
        return self.compute("loop", time=time, **timed).frame()

    @checked
    def state_space(
        self,
        with_: Text | None = None,
        modes: Modes | None = None,
        upto: Frequency | None = None,
        error: Number | None = None,
        wind: bool = False,
        proper: bool = False,
        input: Text | None = None,
        output: Text | None = None,
    ) -> StateSpace:
        """Linear state-space model of the motion: dx/dt = A x + B u, y = C x + D u + D1 u' + D2 u''.

        States x, inputs u and outputs y have names and units in the result. At most one of `modes`, `upto` and `error`
        says how many modes of the cable the model keeps.

        Parameters
        ----------
        with_ : {"gondola", "loop"}, optional
            What the model includes besides the cable, at end 2; of a suspension "loop" or "actuators".
        modes : int, optional
            Number of modes, from the lowest.
        upto : float or str, optional
            Frequency up to which all modes are kept, in Hz or with a unit: 20, "20 Hz".
        error : float, optional
            Largest share of the inertia between one input and one output that omitted modes may have, between 0 and 1.
            The model keeps the fewest modes that satisfy this. [-]
        wind : bool
            True if forces on the nodes of the cable are inputs too.
        proper : bool
            True for a model with D1 = D2 = 0: an input whose acceleration acts on outputs directly is replaced by this
            acceleration, its position and velocity are added to the states. If only the velocity acts, it is the input.
        input, output : str, optional
            Names of the inputs and outputs that the model keeps, separated by commas; by default all.

        Returns
        -------
        control.statespace.StateSpace
        """
        from cablestudy.study.scene_kind import kind_of
        from cablestudy.study.ssm import StateSpaceOptions, exported

        if with_ not in (None, *self.attachable):
            raise SceneError(f"with_: unknown {with_!r} (allowed: {', '.join(self.attachable)})")
        names = {"input": input, "output": output, "proper": proper}
        options = StateSpaceOptions(count=modes, upto=upto, error=error, attached=with_, wind=wind, **names)
        choice = kind_of(self.model).ssm.choose(self.document, self.model, options)
        caller = 3  # of the method, past the check of its arguments
        for line in choice.warnings:
            warnings.warn(line.removeprefix("warning: "), stacklevel=caller)
        return exported(choice.system(), choice.options)

    @checked
    def find(
        self, goal: Goal, by: Text, between: Between | None = None, columns: Columns | None = None
    ) -> pandas.DataFrame:
        """The values of a key for which a column takes a value: pandas.DataFrame, one row for each.

        Parameters
        ----------
        goal : str
            For example "sag = 2 m"; "limits": the ends of the range in which all limits of the scene hold.
        by : str
            The key, for example "cable.preload".
        between : str or sequence of 2, optional
            Its range, for example "100 N:10 kN" or (100, 1e4).
        columns : str or list of str, optional
            Further columns; in text separated by commas.
        """
        return self.compute("find", goal=goal, by=by, between=between, columns=columns).frame()

    @checked
    def trade(self, columns: Columns | None = None, repeats: Runs = 5) -> pandas.DataFrame:
        """Error against time of every model: pandas.DataFrame.

        Parameters
        ----------
        columns : str or list of str, optional
            What to compare; in text separated by commas.
        repeats : int
            Of each timing.

        Notes
        -----
        Where it takes long standard error says how far it is, unless CABLESTUDY_PROGRESS is `off`.
        """
        with ActivityDisplay("trade"):
            return self.compute("trade", columns=columns, repeats=repeats).frame()

    @checked
    def freeze(self) -> str:
        """The scene as a YAML file with its unstretched lengths in full, those of the reference state: str.

        They take the place of preloads, tensions and sags; `base` and changes are resolved, and comments lost.
        """
        from cablestudy.scene.strict_yaml import write_yaml
        from cablestudy.study.scene_kind import kind_of

        return write_yaml(kind_of(self.model).freeze(self.document, self.model))

    @checked
    def plot(self, kind: Picture = "static") -> Figure:
        """A picture: matplotlib.figure.Figure.

        Parameters
        ----------
        kind : {"static", "modes", "windrms", "loop"}
        """
        return self.compute(kind).figure()
