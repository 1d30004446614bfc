"""Physically consistent fit by Clarabel: quadratic cost, one linear matrix inequality per body.

    minimise (1/2) x . H x - b . x   such that   R^(-1/2) P(x) R^(-1/2) >= e 1 for each body,
    viscous >= 0, coulomb >= |asymmetric|, drive inertia >= 0

P and R are those of `unknowns`. A body whose pseudo-inertia is positive definite has a positive
mass, and some distribution of mass has its parameters (Wensing, Kim and Slotine 2018).
"""

import numpy as np

from boom_model.arrays import Array
from boom_model.errors import InfeasibleError
from planner.experiments.unknowns import SPREAD, Unknowns

LEAST_EIGENVALUE = 1e-3
"""e: least eigenvalue of a body's pseudo-inertia, relative to that of the boom's file."""

_COLUMN, _ROW = np.tril_indices(4)
"""Entries of a symmetric matrix in Clarabel's order: upper triangle, column by column."""

_TIMES = np.where(_ROW == _COLUMN, 1.0, np.sqrt(2.0))
_UPPER = [(row, column) for row in range(4) for column in range(row, 4)]


def consistent_fit(unknowns: Unknowns, H: Array, b: Array) -> Array:
    """Return the physically consistent x (90,) of least cost.

    Args:
        unknowns: the unknown parameters.
        H: (90, 90) positive definite; entries that are not active have no effect.
        b: (90,)

    Raises:
        InfeasibleError: Clarabel finds no solution.
    """
    from clarabel import DefaultSettings, DefaultSolver, NonnegativeConeT, PSDTriangleConeT, SolverStatus
    from scipy.sparse import csc_matrix, triu

    active = np.flatnonzero(unknowns.active)
    position = {int(k): i for i, k in enumerate(active)}
    # Variables of unit curvature: Clarabel's accuracy then does not depend on how much the data
    # tell.
    scale = 1.0 / np.sqrt(np.diag(H)[active])
    rows, right, cones = [], [], []
    P0, root = unknowns.metric
    order = [_UPPER.index((int(r), int(c))) for r, c in zip(_ROW, _COLUMN, strict=True)]
    for k in range(len(P0)):
        inverse = np.linalg.inv(root[k])
        start = inverse @ P0[k] @ inverse - LEAST_EIGENVALUE * np.eye(4)
        block = np.zeros((10, 90))
        block[np.arange(10), 10 * k + np.array(order)] = -SPREAD  # svec of D is x itself
        rows.append(block)
        right.append(_TIMES * start[_ROW, _COLUMN])
        cones.append(PSDTriangleConeT(4))
    T, start = np.diag(unknowns.transform), unknowns.start
    signs = [({75 + i: 1.0}, 0.0) for i in range(5)] + [({70 + i: 1.0}, 0.0) for i in range(5) if 70 + i in position]
    signs += [({80 + i: 1.0, 85 + i: way}, 0.0) for i in range(5) for way in (1.0, -1.0)]
    for terms, _ in signs:
        row = np.zeros((1, 90))
        for entry, times in terms.items():
            row[0, entry] = -times * T[entry]
        rows.append(row)
        right.append(np.array([sum(times * start[entry] for entry, times in terms.items())]))
    cones.append(NonnegativeConeT(len(signs)))
    A = csc_matrix(np.concatenate(rows)[:, active] * scale)
    quadratic = H[np.ix_(active, active)] * np.outer(scale, scale)
    settings = DefaultSettings()
    settings.verbose = False
    solver = DefaultSolver(
        csc_matrix(triu(csc_matrix(quadratic))), -b[active] * scale, A, np.concatenate(right), cones, settings
    )
    solution = solver.solve()
    if solution.status not in (SolverStatus.Solved, SolverStatus.AlmostSolved):
        raise InfeasibleError(f"no physically consistent parameters were found: Clarabel says {solution.status}")
    x = np.zeros(90)
    x[active] = scale * np.array(solution.x)
    return x
