"""A state space as a file: .npz, .mat, .json.

All of them hold A, B, C, D, names and units of states, inputs and outputs, and Ts = 0 (continuous time); D1 and D2 are
what the inputs' first and second derivative add to the outputs (see `statespace`). Mass, Damping and Stiffness are the
second-order model with free ends, where there is one. With python-control:

    from scipy.io import loadmat
    m = loadmat("cable.mat")
    system = control.ss(m["A"], m["B"], m["C"], m["D"])

and in MATLAB `load cable.mat`, then `ss(A, B, C, D, 'StateName', StateName, 'InputName', InputName)`.
"""

import io
import json

import numpy as np

GROUPS = (("State", "states"), ("Input", "inputs"), ("Output", "outputs"))


def fields(system):
    """Everything that a file holds: name -> array, list of texts, or 0.

    Parameters
    ----------
    system : StateSpace

    Returns
    -------
    dict
    """
    first, second = system.derivatives
    found = {"A": system.a, "B": system.b, "C": system.c, "D": system.d, "D1": first, "D2": second, "Ts": 0.0}
    for word, attribute in GROUPS:
        found.update(_labels(word, getattr(system, attribute)))
    order = system.second_order
    if order is not None:
        found.update(Mass=order.mass, Damping=order.damping, Stiffness=order.stiffness)
        found.update(_labels("Coordinate", order.coordinates))
    return found


def _labels(word, labels):
    return {f"{word}Name": [name for name, _ in labels], f"{word}Unit": [unit for _, unit in labels]}


def npz(system):
    """Bytes of a numpy archive; names are arrays of text.

    Parameters
    ----------
    system : StateSpace

    Returns
    -------
    bytes
    """
    out = io.BytesIO()
    np.savez(out, **{name: np.array(value) for name, value in fields(system).items()})
    return out.getvalue()


def mat(system):
    """Bytes of a MATLAB file, version 5; names are cell columns, the second-order matrices sparse (M, K, Damping)."""
    from scipy.io import savemat
    from scipy.sparse import csc_array

    found = fields(system)
    for name, value in found.items():
        if isinstance(value, list):
            found[name] = np.array(value, dtype=object).reshape(-1, 1)
    for name, short in (("Mass", "M"), ("Stiffness", "K"), ("Damping", "Damping")):
        if name in found:
            found[short] = csc_array(found.pop(name))
    out = io.BytesIO()
    savemat(out, found, do_compression=True)
    return _dateless(out.getvalue())


def _dateless(data):
    """The header of a MATLAB file without the date, so that equal models are equal files."""
    return b"MATLAB 5.0 MAT-file, cablestudy".ljust(116) + data[116:]


def plain_json(system):
    """Bytes of a JSON object of lists."""
    found = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in fields(system).items()}
    return (json.dumps(found, allow_nan=False) + "\n").encode()


KINDS = {".npz": npz, ".mat": mat, ".json": plain_json}
