"""What `ssm` prints: the modes that were kept, and frequency responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from cablestudy.control import response
from cablestudy.control.ends import GONDOLA, GROUND
from cablestudy.study.ssm import PLACES
from cablestudy.study.table import Field, Table


def mode_table(choice):
    """The modes that are kept.

    Parameters
    ----------
    choice : Choice

    Returns
    -------
    Table
    """
    unit = "N/(m sqrt(kg))"
    fields = (
        *(Field(name, name) for name in ("number", "type", "symmetry")),
        Field("frequency_Hz", "frequency", "Hz"),
        Field("damping_ratio", "damping ratio"),
        Field("participation_end_1", "participation end 1", unit),
        Field("participation_end_2", "participation end 2", unit),
    )
    model, modes = choice.case.end_model, choice.modes
    felt = np.abs(model.participation[:, [GROUND, GONDOLA]])
    felt = np.where(felt > 1e-12 * felt.max(initial=0.0), felt, 0.0)
    rows = [
        {
            "number": int(k) + 1,
            "type": modes.kind[k],
            "symmetry": modes.symmetry[k],
            "frequency_Hz": float(modes.frequency[k]),
            "damping_ratio": float(model.damping_ratio[k]),
            "participation_end_1": float(felt[k, 0]),
            "participation_end_2": float(felt[k, 1]),
        }
        for k in choice.chosen
    ]
    return Table(fields, rows)


@dataclass(frozen=True)
class Curve:
    """One frequency response.

    Attributes
    ----------
    name : str
        Empty when it is the only one.
    label, unit : str
    magnitude, phase : ndarray, shape (m,)
        [unit], [deg]
    """

    name: str
    label: str
    unit: str
    magnitude: np.ndarray
    phase: np.ndarray


def curves(choice, frequency):
    """What the response shows: A and B with a gondola, x/F with a loop, else force over displacement of the ends.

    Parameters
    ----------
    choice : Choice
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    list of Curve
    """
    case, wish, model = choice.case, choice.wish, choice.kept
    if wish.attached == "gondola":
        mass = case.scene.gondola.mass
        return [
            Curve(place, label, "", *response.bode(response.winch_to_gondola(model, mass, place, frequency)))
            for place, label in PLACES.items()
        ]
    if wish.attached == "loop":
        value = response.position(case.loop, model, frequency)
        return [Curve("", "gondola position over the force on it, loop closed", "m/N", *response.bode(value))]
    value = response.between_ends(model, frequency, *wish.pair)
    return [Curve("", f"force at {wish.output} over displacement of {wish.input}", "N/m", *response.bode(value))]


def response_table(frequency, shown):
    """Frequency, and magnitude and phase of each curve.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        [Hz]
    shown : list of Curve

    Returns
    -------
    Table
        Without a number at the pole of an undamped mode.
    """
    fields, data = [Field("frequency_Hz", "frequency", "Hz")], [frequency]
    for curve in shown:
        before, title = (f"{curve.name}_", f"{curve.name} ") if curve.name else ("", "")
        suffix = {"N/m": "_N_per_m", "m/N": "_m_per_N", "": ""}[curve.unit]
        fields += [Field(f"{before}magnitude{suffix}", f"{title}magnitude", curve.unit)]
        fields += [Field(f"{before}phase_deg", f"{title}phase", "deg")]
        data += [curve.magnitude, curve.phase]
    rows = _Rows([field.name for field in fields], data)
    return Table(tuple(fields), rows)


@dataclass(frozen=True)
class _Rows(Sequence):
    """Rows made when they are asked for: a long response would not fit in memory as so many dicts."""

    names: list
    data: list

    def __len__(self):
        return len(self.data[0])

    def __getitem__(self, place):
        if isinstance(place, slice):
            return list(_Rows(self.names, [values[place] for values in self.data]))
        return next(iter(self[place : place + 1 or None]))

    def __iter__(self):
        for begin in range(0, len(self), response.BLOCK):
            block = [values[begin : begin + response.BLOCK].tolist() for values in self.data]
            for cells in zip(*block, strict=True):
                yield {n: c if isfinite(c) else None for n, c in zip(self.names, cells, strict=True)}
