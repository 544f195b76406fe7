"""A state space as a file: .npz, .mat or .json, with the same names in all three.

A, B, C, D, Ts            state-space matrices of dx/dt = A x + B u, y = C x + D u; Ts = 0: continuous time
D1, D2                    what the first and second derivative of the inputs add to the outputs, see `statespace`
StateName, StateUnit      of each state, and likewise InputName, InputUnit, OutputName, OutputUnit
Mass, Damping, Stiffness  the same cable as a second-order model with free ends: M x'' + C x' + K x = f; sparse in .mat
CoordinateName, ...Unit   of each of its coordinates

The second-order matrices have full names because the C of M, C, K is not the C of A, B, C, D. A closed loop has none.
With python-control:

    from scipy.io import loadmat
    m = loadmat("cable.mat", spmatrix=False)
    system = control.ss(m["A"], m["B"], m["C"], m["D"])

and in MATLAB `load cable.mat`, then `ss(A, B, C, D, 'StateName', StateName, 'InputName', InputName)`.
"""

import io
import json

import numpy as np

SECOND_ORDER = ("Mass", "Damping", "Stiffness")


def fields(system):
    """The content of a file of a `StateSpace`: name -> array, list of texts, or number."""
    first, second = system.derivatives
    found = {"A": system.a, "B": system.b, "C": system.c, "D": system.d, "D1": first, "D2": second, "Ts": 0.0}
    labels = {"State": system.states, "Input": system.inputs, "Output": system.outputs}
    order = system.second_order
    if order is not None:
        found |= zip(SECOND_ORDER, (order.mass, order.damping, order.stiffness), strict=True)
        labels["Coordinate"] = order.coordinates
    for word, pairs in labels.items():
        found |= {f"{word}Name": [name for name, _ in pairs], f"{word}Unit": [unit for _, unit in pairs]}
    return found


def npz(system):
    """Bytes of a numpy archive; names are arrays of text."""
    out = io.BytesIO()
    np.savez(out, **{name: np.array(value) for name, value in fields(system).items()})
    return out.getvalue()


def mat(system):
    """Bytes of a MATLAB file, version 5; lists of names are cell columns, the second-order matrices are sparse."""
    from scipy.io import savemat
    from scipy.sparse import csc_array

    found = fields(system)
    for name, value in found.items():
        if isinstance(value, list):
            found[name] = np.array(value, dtype=object).reshape(-1, 1)
        elif name in SECOND_ORDER:
            found[name] = csc_array(value)
    out = io.BytesIO()
    savemat(out, found, do_compression=True)
    # savemat writes the date into the first 116 bytes, and equal models are to give equal files
    return b"MATLAB 5.0 MAT-file, cablestudy".ljust(116) + out.getvalue()[116:]


def plain_json(system):
    """Bytes of a JSON object; matrices are lists of rows."""
    members = (f"{json.dumps(name)}: {_json(value)}" for name, value in fields(system).items())
    return f"{{{', '.join(members)}}}\n".encode()


def _json(value):
    """JSON text of a value; a matrix row by row, since as Python numbers it is several times larger."""
    if isinstance(value, np.ndarray):
        return f"[{', '.join(json.dumps(row.tolist(), allow_nan=False) for row in value)}]"
    return json.dumps(value, allow_nan=False)


KINDS = {".npz": npz, ".mat": mat, ".json": plain_json}
