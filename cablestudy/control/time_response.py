"""Response in time of a linear system to inputs that are themselves solutions of linear equations: steps and gusts.

With x' = A x + B u, y = C x + D u and an input u = h z, z' = S z, state and input together obey one equation without
input, whose solution over a time step is a matrix exponential:

    [x]'   [A  B h] [x]
    [z]  = [0   S ] [z]

No error is made by the size of the time step (Franklin, Powell and Workman, Digital Control of Dynamic Systems, 1998,
section 4.3, for a step; here the same for a cosine).
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.tolerances import CONTROL


@dataclass(frozen=True)
class Component:
    """Part of an input, u = h z with z' = S z, from a time on; before that time it is zero.

    Attributes
    ----------
    begin : float
        >= 0. [s]
    output : ndarray, shape (k,)
        h.
    matrix : ndarray, shape (k, k)
        S.
    start : ndarray, shape (k,)
        z when it begins.
    """

    begin: float
    output: np.ndarray
    matrix: np.ndarray
    start: np.ndarray


def step(size):
    """Components of an input that is constant from time zero on: list."""
    return [Component(0.0, np.array([size]), np.zeros((1, 1)), np.ones(1))]


def gust(size, length):
    """Components of a 1-cosine gust, size/2 (1 - cos(2 pi t/length)) while 0 < t < length: list.

    Parameters
    ----------
    size : float
        Its largest value.
    length : float
        [s]

    Notes
    -----
    The shape of a discrete gust (EASA, CS-25, paragraph 25.341), whose rise is that of the extreme coherent gust of IEC
    61400-1, ed. 3, section 6.3.2.5. It is a periodic input less the same from t = length on.
    """
    omega = 2 * np.pi / length
    matrix = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -omega], [0.0, omega, 0.0]])
    output, start = np.array([size / 2, -size / 2, 0.0]), np.array([1.0, 1.0, 0.0])
    return [Component(0.0, output, matrix, start), Component(length, -output, matrix, start)]


def respond(a, b, c, d, components, time):
    """Response over time of the outputs of a linear system, from rest, to one input: exact at each point of time.

    Parameters
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n,), (o, n), (o,)
        State-space matrices with one input.
    components : list of Component
        Their sum is the input.
    time : ndarray, shape (m,)
        Uniform, from zero. [s]

    Returns
    -------
    ndarray, shape (m, o)

    Notes
    -----
    Each component and the state obey one equation without input (module's docstring), advanced by exp(matrix dt).
    """
    from scipy.linalg import expm

    outputs, step = np.zeros((len(time), len(c))), time[1] - time[0]
    for component in components:
        first_index = int(np.ceil(component.begin / step - CONTROL.component_begin))
        if first_index >= len(time):
            continue
        n, k = len(a), len(component.start)
        matrix = np.zeros((n + k, n + k))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, n:] = a, np.outer(b, component.output), component.matrix
        output = np.concatenate([c, np.outer(d, component.output)], axis=1)
        state = np.concatenate([np.zeros(n), component.start])
        # from the beginning of the component to the first point of time after it, then from point to point
        state = expm(matrix * max(first_index * step - component.begin, 0.0)) @ state
        advance = expm(matrix * step)
        for index in range(first_index, len(time)):
            outputs[index] += output @ state
            state = advance @ state
    return outputs
