"""Parts of a state space for other programs: some channels of it, and the same without derivatives of its inputs."""

from dataclasses import replace

import numpy as np

RATES = ("velocity", "acceleration")
PER_SECOND = {"m": ("m/s", "m/s^2"), "rad": ("rad/s", "rad/s^2")}


def channels(system, inputs=(), outputs=()):
    """The `StateSpace` with some of its inputs and outputs, by their numbers and in that order; empty keeps all."""
    kept = list(outputs) or slice(None), list(inputs) or slice(None)
    rows, columns = (np.arange(size)[part] for size, part in zip(system.d.shape, kept, strict=True))
    entries = np.ix_(rows, columns)
    return replace(
        system,
        b=system.b[:, columns],
        c=system.c[rows],
        d=system.d[entries],
        inputs=tuple(system.inputs[k] for k in columns),
        outputs=tuple(system.outputs[k] for k in rows),
        derivatives=tuple(part[entries] for part in system.derivatives),
        second_order=None,
    )


def proper(system):
    """`StateSpace` without D1 and D2, for programs that know A, B, C, D alone; its response is exactly the same.

    An input u whose acceleration acts on an output is replaced by u'', and u and u' become states; an input of which
    u' acts, and u'' does not, is replaced by u', and u becomes a state. So y = C x + D u + D1 u' + D2 u'' is a sum of
    states and inputs. Other inputs are as they were. The added states are integrators: the system drifts unless the
    new input is the velocity or acceleration of a movement that ends.
    """
    first, second = system.derivatives
    # of each input the order of its highest derivative that acts on an output
    orders = [2 if two.any() else 1 if one.any() else 0 for one, two in zip(first.T, second.T, strict=True)]
    n, extra = len(system.a), sum(orders)
    a, b = np.pad(system.a, (0, extra)), np.pad(system.b, ((0, extra), (0, 0)))
    c, d = np.pad(system.c, ((0, 0), (0, extra))), system.d.copy()
    states, inputs, state = list(system.states), list(system.inputs), n
    for column, order in enumerate(orders):
        if not order:
            continue
        name, unit = system.inputs[column]
        rates = PER_SECOND.get(unit, (f"{unit}/s", f"{unit}/s^2"))
        # u and u' as states, or u alone
        a[:n, state], c[:, state] = system.b[:, column], system.d[:, column]
        b[:, column], d[:, column] = 0.0, (first, second)[order - 1][:, column]
        b[state + order - 1, column] = 1.0
        states.append((name, unit))
        if order == 2:
            a[state, state + 1] = 1.0
            c[:, state + 1] = first[:, column]
            states.append((f"{name}_velocity", rates[0]))
        inputs[column] = (f"{name}_{RATES[order - 1]}", rates[order - 1])
        state += order
    zeros = np.zeros_like(d), np.zeros_like(d)
    return replace(system, a=a, b=b, c=c, d=d, states=tuple(states), inputs=tuple(inputs), derivatives=zeros,
                   second_order=None)  # fmt: skip
