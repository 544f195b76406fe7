"""The winch loop of one cable and of a suspension: tables of the file as typed models, in SI."""

from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from cablestudy.scene.determinacy import MOTIONS
from cablestudy.scene.fields import Delay, Either, Frequency, KeyTable, Name, Quantity, each_once
from cablestudy.scene.tolerances import SCENE

_margin = Quantity("dB", 1e-6, 300)


class Margin(KeyTable):
    """Margins that an automatic gain keeps: it is the largest one that satisfies both."""

    gain_margin: Annotated[float, _margin] = Field(description="Least gain margin")
    sensitivity: Annotated[float, Quantity("", 1.001, 1e9)] = Field(
        2.0, description="Largest peak of the sensitivity |1/(1 + L)|, of several winches the largest singular value"
    )


def _number_or(table, quantity):
    """The type of a `Quantity`, which refuses what is no mapping, or of a mapping that the model `table` reads."""
    number = Either.of_number(quantity, kind=(int, float, str, list, tuple, type(None)))
    return Annotated[Annotated[float, quantity] | table, Either("", (number, Either.of_table(table)))]


def _as_margin(value):
    """`Margin` of a gain margin in dB; a `Margin` itself."""
    return value if isinstance(value, Margin) else Margin(gain_margin=value)


class AutoGain(KeyTable):
    """`gain: {auto: 6 dB}`, or `{auto: {gain_margin: 6 dB, sensitivity: 2}}`: the gain follows from margins."""

    auto: Annotated[_number_or(Margin, _margin), AfterValidator(_as_margin)] = Field(
        description="What the gain is chosen for: gain margin, and peak of the sensitivity"
    )


class NotchTable(KeyTable):
    """The filter in series with the integrator."""

    frequency: Annotated[float | str, Quantity("Hz", 1e-9, 1e9, words=("coupled", "static"))] = Field(
        "coupled", description="The gondola frequency that the notch removes: coupled, static, or a frequency"
    )
    damping_ratio: Annotated[float, Quantity("", 0, 1e6)] = Field(0.05, description="Damping ratio of the notch")
    rolloff_frequency: Frequency = Field(10.0, description="Frequency of the roll-off")
    rolloff_damping_ratio: Annotated[float, Quantity("", 1e-9, 1e6)] = Field(
        1.0, description="Damping ratio of the roll-off"
    )


def _none_word(value):
    """None for the word `none`, which switches the notch off; null means an absent key, and the default notch."""
    return None if value == "none" else value


class Controller(KeyTable):
    """PID controller with notch that drives winches; without other gains an integrator."""

    gain: _number_or(AutoGain, Quantity("rad/s", 0, 1e12, SCENE.least_positive)) = Field(
        description="Integral gain, or {auto: 6 dB}: the largest with this gain margin and a sensitivity of at most 2"
    )
    notch: Annotated[NotchTable | None, BeforeValidator(_none_word)] = Field(
        NotchTable.model_construct(), description="Notch filter, or none"
    )
    proportional_gain: Annotated[float, Quantity("", 0, 1e9, SCENE.least_positive)] = Field(
        0.0, description="Displacement of the winch per measured displacement; needs bandwidth of the winch"
    )
    derivative_gain: Annotated[float, Quantity("s", 0, 1e9, SCENE.least_positive)] = Field(
        0.0, description="The same per velocity; needs derivative_filter, and bandwidth of the winch"
    )
    derivative_filter: Frequency | None = Field(
        None, description="Corner frequency of the low-pass filter of the derivative part"
    )

    @property
    def integrates_only(self):
        """True if there is neither a proportional nor a derivative part."""
        return (self.proportional_gain == 0) & (self.derivative_gain == 0)

    def relations(self):
        """Yield relations: a derivative needs a filter; an integral part is needed, and stands alone if `auto`."""
        filtered = (self.derivative_gain == 0) | (self.derivative_filter is not None)
        integral = self.integrates_only | (not isinstance(self.gain, AutoGain))
        yield [
            (("derivative_filter",), filtered, "missing key: derivative_gain needs it"),
            (("gain",), integral, "auto chooses an integral gain: not with proportional or derivative_gain"),
        ]
        if not isinstance(self.gain, AutoGain):
            integrates = (self.gain > 0) | self.integrates_only
            message = "must be above 0 with proportional or derivative_gain: a small one is as good as none"
            yield [(("gain",), integrates, message)]


class Drive(KeyTable):
    """Drive of a winch: how it follows its controller."""

    delay: Delay = Field(0.0, description="From the measurement to the movement of the winch, in the loop")
    bandwidth: Frequency | None = Field(
        None, description="Of the drive, a lag of first order; without it the winch follows without delay"
    )
    max_speed: Annotated[float, Quantity("m/s", 1e-12, 1e9)] | None = Field(
        None, description="Largest speed of the winch: a loop that asks for more in the wind has no linear answer"
    )

    def follows(self, controller):
        """Relations: a winch that follows without delay is driven by an integrator."""
        if self.bandwidth is None:
            message = "missing key: with proportional or derivative_gain a winch without lag would follow accelerations"
            yield [(("bandwidth",), controller.integrates_only, message)]


class AllocationTable(KeyTable):
    """Sharing of an error of the pose among the winches."""

    method: Literal["least"] = Field("least", description="Least weighted sum of squares of the winches' movements")
    weights: dict[Name, Annotated[float, Quantity("", 1e-12, 1e12)]] = Field(
        {}, description="Name of a winch -> relative cost of its movement (default 1)"
    )

    def __hash__(self):
        return hash((self.method, frozenset(self.weights.items())))


class Control(Drive, Controller):
    """The loop of all winches of a suspension: one controller with a notch for each measured coordinate."""

    body: Name | None = Field(None, description="Body whose pose is controlled; needed where there are several bodies")
    measured: Annotated[tuple[Literal[MOTIONS], ...], AfterValidator(each_once)] | None = Field(
        None, min_length=1, description="What of its pose is measured (default: what is free)"
    )
    allocation: AllocationTable | None = Field(None, description="How an error is shared among the winches")

    def relations(self):
        """Relations of the controller, and of the drives of the winches."""
        yield from super().relations()
        yield from self.follows(self)
