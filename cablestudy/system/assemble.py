"""Assembly of superelements of cables and of bodies into one `LinearSystem`, dense or sparse."""

import numpy as np

from cablestudy.system.linear import LinearSystem


def assemble(cables, connection, bodies, imposed=None, stiffness=0.0):
    """Assemble the `LinearSystem` M z'' + C z' + K z = B0 u + B1 u' + B2 u'' of cables, bodies and winches.

    The coordinates z are the modal amplitudes q of one cable after the other, then the displacements x of the bodies.
    The inputs u are the movements of the i winches.

    Parameters
    ----------
    cables : sequence of Superelement
        The c cables, each with matrices of its modes and its six end displacements.
    connection : ndarray or sparse array, shape (6 c, b)
        G: end displacements of one cable after the other, per displacement of the bodies. If it is sparse, the matrices
        of the result are sparse.
    bodies : ndarray or sparse array, shape (b, b)
        Mass matrix of the b displacements of the bodies.
    imposed : ndarray, shape (6 c, i), optional
        H: end displacements of the cables per movement of each winch. Default: no winches.
    stiffness : ndarray or sparse array, shape (b, b), optional
        Stiffness of the bodies without that of the cables. Default: zero.

    Returns
    -------
    LinearSystem

    Notes
    -----
    The ends of the cables move by G x + H u. Let A be the block-diagonal mass (or damping, or stiffness) matrix of all
    modes and ends, and T = [I, 0; 0, G]. Then M = T^T A T, plus `bodies`, and B2 = -T^T A [0; H]. C and B1 follow in
    this way from the damping matrices, and K (plus `stiffness`) and B0 from the stiffness matrices.
    """
    imposed = np.zeros((connection.shape[0], 0)) if imposed is None else imposed
    matrices = [cable.matrices() for cable in cables]
    if not isinstance(connection, np.ndarray):
        return _assemble_sparse(cables, matrices, connection, bodies, imposed, stiffness)
    return assemble_dense(matrices, connection, bodies, imposed, stiffness)


def assemble_dense(matrices, connection, bodies, imposed, stiffness=0.0):
    """Assemble the `LinearSystem` of cables, bodies and winches from dense matrices.

    Symbols and equations are those of `assemble`: the ends of the c cables move by G x + H u, x being the b
    displacements of the bodies and u the movements of the i winches. Leading axes `...` are those of many systems.

    Parameters
    ----------
    matrices : list of tuple of 3 ndarray, shape (..., n + 6, n + 6)
        M, C and K of each cable, for its n modes and then its six end displacements. K is complex if its damping is
        hysteretic.
    connection : ndarray, shape (..., 6 c, b)
        G: end displacements of one cable after the other, per displacement of the bodies.
    bodies : ndarray, shape (..., b, b)
        Mass matrix of the bodies.
    imposed : ndarray, shape (..., 6 c, i)
        H: end displacements of the cables per movement of each winch.
    stiffness : ndarray, shape (..., b, b), or 0
        Stiffness of the bodies without that of the cables.

    Returns
    -------
    LinearSystem
    """
    modal, leading = sum(mass.shape[-1] - 6 for mass, *_ in matrices), bodies.shape[:-2]
    hysteretic = any(np.iscomplexobj(stiffness_of_cable) for *_, stiffness_of_cable in matrices)
    size = modal + bodies.shape[-1]
    # M, C, K, and what they make of the movements of the winches: minus B2, B1, B0
    systems = np.zeros((3, *leading, size, size), dtype=complex if hysteretic else float)
    of_winches = np.zeros((3, *leading, size, imposed.shape[-1]), dtype=systems.dtype)
    begin, body = 0, slice(modal, None)  # first mode of the next cable; the bodies
    systems[0, ..., body, body], systems[2, ..., body, body] = bodies, stiffness
    for cable, of_cable in enumerate(matrices):
        n = of_cable[0].shape[-1] - 6
        modes, ends = slice(begin, begin + n), slice(6 * cable, 6 * cable + 6)
        g, h = connection[..., ends, :], imposed[..., ends, :]
        transposed = np.swapaxes(g, -1, -2)
        for system, by_winches, matrix in zip(systems, of_winches, of_cable, strict=True):
            of_modes, coupling, of_ends = matrix[..., :n, :n], matrix[..., :n, n:], matrix[..., n:, n:]
            system[..., modes, modes] = of_modes
            system[..., modes, body] = coupling @ g
            system[..., body, modes] = np.swapaxes(system[..., modes, body], -1, -2)
            system[..., body, body] += transposed @ of_ends @ g
            by_winches[..., modes, :] += coupling @ h
            by_winches[..., body, :] += transposed @ of_ends @ h
        begin += n
    mass, damping, total_stiffness = systems
    return LinearSystem(mass.real, damping.real, total_stiffness, tuple(-of_winches[::-1]), bodies.shape[-1])


def _assemble_sparse(cables, matrices, connection, bodies, imposed, stiffness):
    """Assemble the `LinearSystem` by products of sparse matrices, with the symbols and equations of `assemble`.

    Parameters are those of `assemble_dense` for one system, and the `cables` (list of Superelement) of the matrices;
    `connection` (G), `bodies` and `stiffness` may be sparse.
    """
    from scipy.sparse import block_array, csc_array, eye_array

    modal = sum(len(cable.omega) for cable in cables)
    bodies, stiffness = csc_array(bodies), csc_array(stiffness) if np.ndim(stiffness) else 0 * csc_array(bodies)
    blocks = [[eye_array(modal), None], [None, connection]]
    by_system = block_array(blocks, format="csr") if modal else csc_array(connection)  # T = [I, 0; 0, G]
    by_winches = np.concatenate([np.zeros((modal, imposed.shape[1])), imposed])  # [0; H]
    systems, of_winches = [], []
    for matrix, of_bodies in zip(_block_diagonal(cables, matrices), (bodies, 0 * bodies, stiffness), strict=True):
        if modal:
            of_bodies = block_array([[csc_array((modal, modal)), None], [None, of_bodies]], format="csc")
        systems.append((by_system.T @ matrix @ by_system + of_bodies).tocsc())
        # sorts the indices too: scipy sorts them in place when it needs to, and a copy that shares the values would not
        # know of their new order
        systems[-1].sum_duplicates()
        of_winches.append(by_system.T @ (matrix @ by_winches))
    mass, damping, total_stiffness = systems
    inputs = tuple(-matrix for matrix in of_winches[::-1])
    return LinearSystem(mass.real, damping.real, total_stiffness, inputs, bodies.shape[0])


def _block_diagonal(cables, matrices):
    """Block-diagonal M, C and K of all c cables, sparse, shape (N + 6 c, N + 6 c): list.

    Rows and columns are the N modes of all cables, one cable after the other; then the six ends of each, likewise.
    """
    from scipy.sparse import coo_array

    sizes = np.array([len(cable.omega) for cable in cables])
    modal, first_mode = int(sizes.sum()), np.cumsum(sizes) - sizes
    shape = (modal + 6 * len(cables),) * 2
    rows, columns, values = [], [], ([], [], [])  # of the entries; values of M, C and K
    for size in np.unique(sizes):
        of_size = np.flatnonzero(sizes == size)
        modes, ends = first_mode[of_size, None] + np.arange(size), modal + 6 * of_size[:, None] + np.arange(6)
        index = np.concatenate([modes, ends], axis=1)  # row in the whole matrix of each row of a cable's matrix
        rows.append(np.repeat(index, size + 6, axis=1).ravel())
        columns.append(np.tile(index, (1, size + 6)).ravel())
        for number, entries in enumerate(values):  # 0, 1, 2: M, C, K
            entries.append(np.array([matrices[cable][number] for cable in of_size.tolist()]).ravel())
    rows, columns, sparse = np.concatenate(rows), np.concatenate(columns), []
    for entries in map(np.concatenate, values):
        nonzero = entries != 0
        sparse.append(coo_array((entries[nonzero], (rows[nonzero], columns[nonzero])), shape=shape).tocsr())
    return sparse
