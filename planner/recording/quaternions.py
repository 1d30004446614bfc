"""Unit quaternions of rotations. SciPy's would take half as long to import as Rerun itself."""

import numpy as np

from boom_model.arrays import Array


def quaternions(R: Array) -> Array:
    """Return the unit quaternions (n, 4) of rotation matrices R (n, 3, 3), the real part last.

    The largest of the four components is computed as a square root, positive, and the others from
    it, so that no small number is divided by (S. W. Shepperd, Journal of Guidance and Control,
    1978).
    """
    diagonal = np.diagonal(R, axis1=1, axis2=2)
    trace = diagonal.sum(axis=1)
    largest = np.column_stack([diagonal, trace]).argmax(axis=1)
    found = np.empty((len(R), 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        of = largest == i
        M = R[of]
        found[of, i] = 1.0 - trace[of] + 2.0 * M[:, i, i]
        found[of, j], found[of, k] = M[:, j, i] + M[:, i, j], M[:, k, i] + M[:, i, k]
        found[of, 3] = M[:, k, j] - M[:, j, k]
    of = largest == 3
    M = R[of]
    found[of, 3] = 1.0 + trace[of]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        found[of, i] = M[:, k, j] - M[:, j, k]
    unit: Array = found / np.linalg.norm(found, axis=1, keepdims=True)
    return unit
