"""Deflection of the tip through the gearboxes, and what a calibration leaves uncertain of it."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, broadcast
from boom_model.boom import JOINTS, Boom
from boom_model.drives.drive import Drive
from boom_model.drives.wind_up import wind_up
from boom_model.kinematics.forward import position_jacobian
from boom_model.tip_uncertainty import tip_deviation

SURE = 2.0
"""Number of standard deviations of the geometry in the total: at least 95 % of the errors."""


@dataclass(frozen=True, eq=False)
class TipDeflection:
    """Deviation of the tip from the rigid model, by drives and by the calibration's uncertainty."""

    wind_up: Array
    """(..., 3) displacement of the tip in frame 1 by the wind-up of the gearboxes [m]."""
    backlash: Array
    """(...) largest displacement of the tip by backlash [m]."""
    hysteresis: Array
    """(...) largest displacement of the tip by the hysteresis of the gearboxes [m]."""
    step: Array
    """(...) largest displacement of the tip by the microstep error of the motors [m]."""
    geometry: Array
    """(...) standard deviation of the tip by calibrated figures [m]; 0 without a calibration."""
    uncounted: tuple[str, ...]
    """What is left out because data is missing, one phrase each."""

    @property
    def total(self) -> Array:
        """(...) largest total displacement [m]: the sum of the magnitudes of all parts.

        The geometry counts `SURE` times.
        """
        size: Array = np.linalg.norm(self.wind_up, axis=-1)
        return size + self.backlash + self.hysteresis + self.step + SURE * self.geometry


def tip_deflection(boom: Boom, q: ArrayLike, tau: ArrayLike) -> TipDeflection:
    """Return the displacement of the tip under joint torques (..., 5) [Nm].

    It is d = J_v dq, to first order. A gearbox yields to the load that its torque balances: dq_i =
    -c_i wind_up(tau_i), with the share c_i that a calibration has measured, else 1. Backlash,
    hysteresis and microstep error are widths of unknown sign: each displacement is the largest
    |sum_i +-J_v,i b_i| over all signs.

    Raises:
        InputError: q or tau is not finite or not (..., 5), or they do not broadcast.
    """
    q, tau = broadcast(q=q, tau=tau)
    J = np.moveaxis(position_jacobian(boom, q), (-2, -1), (0, 1))
    moved = np.zeros((3, *tau.shape[:-1]))
    widths = {"backlash": np.zeros(5), "hysteresis": np.zeros(5), "step": np.zeros(5)}
    uncounted, share = [], np.ones(5) if boom.calibration is None else boom.calibration.wind_up
    for i, drive in enumerate(boom.drives):
        if drive is None:
            uncounted.append(f"{JOINTS[i]}: no drive data")
            continue
        angle = wind_up(drive.gearbox, tau[..., i])
        if angle is not None:
            moved -= J[:, i] * (share[i] * angle)
        known = {"wind-up": angle, "backlash": drive.gearbox.backlash, "hysteresis": drive.gearbox.hysteresis}
        known["microstep error"] = step = _step_error(drive)
        uncounted += [f"{JOINTS[i]}: no {name} is printed" for name, value in known.items() if value is None]
        for name, value in zip(widths, (drive.gearbox.backlash, drive.gearbox.hysteresis, step), strict=True):
            widths[name][i] = value or 0.0
    lost = np.moveaxis(moved, 0, -1)
    sd = tip_deviation(boom, q, tau)
    geometry = np.zeros(q.shape[:-1]) if sd is None else sd
    if np.isnan(geometry).any():
        uncounted.append("geometry, where the linkage is flat")
    counted = {name: _worst(J, width) for name, width in widths.items()}
    return TipDeflection(lost, **counted, geometry=np.nan_to_num(geometry), uncounted=tuple(uncounted))


def gear_stiffness(drives: tuple[Drive | None, ...]) -> tuple[Array, Mask]:
    """Return the stiffness K1 of each joint's gearbox (5,) [Nm/rad], and which are known."""
    stiffness = [None if d is None or d.gearbox.torsion_stiffness is None else d.gearbox.torsion_stiffness[0] for d in drives]
    return np.array([k or 0.0 for k in stiffness]), np.array([k is not None for k in stiffness])


def gear_frequencies(boom: Boom, M: Array) -> Array | None:
    """Return the natural frequencies (..., k) [Hz] of the arm on its k elastic gearboxes.

        det(K - (2 pi f)^2 M) = 0,  M (..., 5, 5) from `mass_matrix`

    K holds the first stiffness of the gearboxes. The frequencies ascend. The other joints are
    locked. Return None if no gearbox has a printed stiffness.
    """
    stiffness, known = gear_stiffness(boom.drives)
    if not known.any():
        return None
    root = 1.0 / np.sqrt(stiffness[known])
    inverse = np.linalg.eigvalsh(root[:, None] * M[..., known, :][..., :, known] * root)
    with np.errstate(divide="ignore"):  # a massless arm has infinite frequencies
        frequencies: Array = 1.0 / (2.0 * np.pi * np.sqrt(np.maximum(inverse[..., ::-1], 0.0)))
    return frequencies


def _step_error(drive: Drive) -> float | None:
    return None if drive.motor.microstep_accuracy is None else drive.motor.microstep_accuracy / drive.gearbox.ratio


def _worst(J: Array, widths: Array) -> Array:
    """Return the largest |sum_i +-J_i w_i| (...) over all signs, for J (3, 5, ...).

    The first sign can be fixed, because the magnitude does not depend on a common sign.
    """
    moves = [J[:, i] * widths[i] for i in np.flatnonzero(widths)]
    if not moves:
        return np.zeros(J.shape[2:])
    squares = []
    for signs in product((1.0, -1.0), repeat=len(moves) - 1):
        total = sum((sign * move for sign, move in zip(signs, moves[1:], strict=True)), moves[0])
        squares.append(np.square(total).sum(axis=0))
    worst: Array = np.sqrt(np.maximum.reduce(squares))
    return worst
