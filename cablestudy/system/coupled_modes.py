"""The lowest coupled modes of one suspension, or of many with equal names and connections."""

from functools import partial

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.errors import outcome_of, result_of
from cablestudy.system.coupled import Layout
from cablestudy.system.hanging_cables import UNDAMPED, Cables
from cablestudy.system.mode_search import Search


def coupled_modes(
    equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None, cables=None, damped=False, shaped=False
):
    """The lowest coupled modes of one suspension, to an accuracy or with elements that the scene states.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of one case; the modes are small motions about it.
    count : int
        Number of modes.
    accuracy : float
        Largest relative error of the frequencies that is allowed. [-]
    damping : Damping or sequence of Damping
        Of all cables, or of each.
    model : FixedModel, optional
        Elements of each cable that the scene states. They take the place of `accuracy`.
    cables : Cables, optional
        The cables with their damping. Default: made of `equilibrium` and `damping`.
    damped : bool
        True to compute damping from the modes too: meshes are finer, and more modes of the cables are coordinates.
    shaped : bool
        True to compute the form of each cable under loads from the modes too: more modes of the cables are coordinates.

    Returns
    -------
    CoupledModes

    Raises
    ------
    NoSolutionError
        The equilibrium is not stable, or a cable has no definite motion, as where it hangs folded.
    ConvergenceError
        No equilibrium was found, or the accuracy cannot be reached.
    """
    drag = model and model.drag
    static = equilibrium.end_stiffness[equilibrium.suspension.of_cables]
    cables = cables or Cables(equilibrium.catenary, damping, static, drag)
    search = Search(equilibrium, count, accuracy, cables, damped, shaped)
    return result_of((search.solve_stated_elements(model) if model else search.solve())[0])


def coupled_modes_of_cases(equilibrium, count, accuracy, damping, planes=None, damped=False, model=None):
    """The lowest coupled modes of n suspensions ("cases") with equal names and connections.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, shape (n,), with c cables each; the modes are small motions about it.
    count : int
        Number of modes of each case.
    accuracy : float
        Largest relative error of the frequencies that is allowed. [-]
    damping : sequence of Damping
        Of the n c cables, those of one case after the other.
    planes : tuple of tuple of int, optional
        Axes of the chord frame along which cables move, in uncoupled groups, as ((0, 1), (2,)). Default: all.
    damped : bool
        True to compute damping from the modes too: meshes are finer, and more modes of the cables are coordinates.
    model : FixedModel, optional
        Elements of each cable that the scene states, in place of `accuracy`; with the drag on all n c cables.

    Returns
    -------
    list of (CoupledModes or Exception)
        For each case its modes, or the reason why it has none.
    """
    cases, cables_of_case = equilibrium.lengths.shape
    if Layout(equilibrium).large:  # sparse matrices: one after the other
        outcomes = []
        for case in range(cases):
            index = slice(cables_of_case * case, cables_of_case * (case + 1))
            of_case = equilibrium.take(case), count, accuracy, damping[index], take_rows(model, index)
            outcomes.append(outcome_of(partial(coupled_modes, *of_case, damped=damped)))
        return outcomes
    catenary = equilibrium.catenary.take(tuple(np.indices((cases, cables_of_case)).reshape(2, -1)))
    static = equilibrium.end_stiffness[:, equilibrium.suspension.of_cables].reshape(-1, 3, 3)
    cables = Cables(catenary, damping, static, model and model.drag, planes)
    search = Search(equilibrium, count, accuracy, cables, damped)
    return search.solve_stated_elements(model) if model else search.solve()
