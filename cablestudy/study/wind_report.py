"""Table of the command `windrms`."""

from cablestudy.scene.scene import missing
from cablestudy.study.columns import find, lacks
from cablestudy.study.row import evaluate
from cablestudy.study.sweep import STATUS, field_of
from cablestudy.study.table import Field, Table
from cablestudy.study.windrms import BELOW

CLOSED = ("gondola_rms", "gondola_rms_velocity", "gain_margin", "phase_margin", "bandwidth", "largest_gain")
OPEN = (
    "gondola_rms_open_loop",
    "gondola_rms_velocity_open_loop",
    "gondola_frequency",
    "gondola_frequency_static",
    "gondola_damping_ratio",
)


def wind_table(document, scene):
    """The gondola in the wind, with the winch loop where the scene has a controller.

    Parameters
    ----------
    document : Document
    scene : Scene

    Returns
    -------
    table : Table
        One row.
    row : Row

    Raises
    ------
    SceneError
        The scene has no gondola or no wind.
    """
    columns = [find(name) for name in (*CLOSED, *OPEN)]
    if scene.winch is None or scene.winch.controller is None:
        columns = [find(name) for name in OPEN]
    for column in columns:
        if lacks(scene, column):
            raise missing(document, lacks(scene, column), "windrms")
    row = evaluate(scene, columns)
    fields, cells = [field_of(column) for column in columns], dict(row.cells)
    if not row.failed:
        response = row.case.response
        for limit, share in zip(BELOW, response.shares, strict=True):
            name = f"variance_share_below_{limit:g}_Hz"
            fields.append(Field(name, f"variance share below {limit:g} Hz"))
            cells[name] = share
        fields.append(Field("integration_error", "integration error"))
        cells["integration_error"] = response.error
    return Table((*fields, STATUS), [cells], single=True), row
