"""Wind-up of a strain-wave gearbox under torque."""

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.drives.drive import Gearbox


def wind_up(gearbox: Gearbox, torque: ArrayLike) -> Array | None:
    """Return the angle [rad] by which the output lags the input under a torque [Nm].

        |T| <= T1:       T / K1
        T1 < |T| <= T2:  T1 / K1 + (T - T1) / K2
        |T| > T2:        T1 / K1 + (T2 - T1) / K2 + (T - T2) / K3

    The angle has the sign and the shape of the torque. This is the makers' curve of three linear
    pieces (thesis, Appendix E, "Torsional Stiffness"). Return None if the curve is not printed.
    """
    if gearbox.torsion_torques is None or gearbox.torsion_stiffness is None:
        return None
    (T1, T2), (K1, K2, K3) = gearbox.torsion_torques, gearbox.torsion_stiffness
    signed = np.asarray(torque, dtype=float)
    size = np.abs(signed)
    angle = np.minimum(size, T1) / K1 + np.clip(size - T1, 0.0, T2 - T1) / K2 + np.maximum(size - T2, 0.0) / K3
    result: Array = np.copysign(angle, signed)
    return result
