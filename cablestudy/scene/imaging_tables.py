"""Tables of what a telescope makes of the motion: the time of one exposure, and a mirror that corrects the image."""

from typing import Annotated

from pydantic import Field

from cablestudy.scene.fields import LEAST, KeyTable, Name, Quantity

Exposure = Annotated[float, Quantity("s", 1e-12, 1e12)]


class Correction(KeyTable):
    """The tip/tilt/piston mirror that follows the motion."""

    bandwidth: Annotated[float, Quantity("Hz", 1e-9, 1e9)] = Field(description="Bandwidth of the correction")
    delay: Annotated[float, Quantity("s", 0, 1e6, LEAST)] = Field(
        0.0, description="Time between measurement and correction"
    )

    def relations(self):
        """The mirror's loop, an integrator with a delay, is stable."""
        highest = "an unstable mirror: with this delay it must be below 1/(4 delay) = {:.4g} Hz"
        yield [(("bandwidth",), 4 * self.bandwidth * self.delay < 1, lambda: highest.format(0.25 / self.delay))]


class MarkerCorrection(Correction):
    """The correction of a suspension, of the motion of one marker."""

    marker: Name = Field(description="Whose motion is corrected: BODY.MARKER")
