"""How far a strain-wave gearbox gives under its torque, and what that costs at the tip."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, Mask, broadcast
from boom_model.boom import JOINTS, Boom
from boom_model.drives.drive import Drive, Gearbox
from boom_model.kinematics.forward import jacobian


def wind_up(gearbox: Gearbox, torque: ArrayLike) -> Array | None:
    """Angle [rad] by which the output lags the input under a torque [Nm], signed like the torque and of its shape.

        |T| <= T1:       T / K1
        T1 < |T| <= T2:  T1 / K1 + (T - T1) / K2
        |T| > T2:        T1 / K1 + (T2 - T1) / K2 + (T - T2) / K3

    The makers' three-piece curve (thesis, Appendix E, "Torsional Stiffness"). None where the curve is not printed.
    """
    if gearbox.torsion_torques is None or gearbox.torsion_stiffness is None:
        return None
    (T1, T2), (K1, K2, K3) = gearbox.torsion_torques, gearbox.torsion_stiffness
    signed = np.asarray(torque, dtype=float)
    size = np.abs(signed)
    angle = np.minimum(size, T1) / K1 + np.clip(size - T1, 0.0, T2 - T1) / K2 + np.maximum(size - T2, 0.0) / K3
    result: Array = np.copysign(angle, signed)
    return result


@dataclass(frozen=True, eq=False)
class TipDeflection:
    """Where the tip is against where the rigid model puts it, by the drives of the joints alone."""

    wind_up: Array
    """(..., 3) displacement of the tip in frame 1 [m], by the gearboxes' wind-up under the torques."""
    backlash: Array
    """(...) the most that backlash may move the tip [m]."""
    hysteresis: Array
    """(...) the most that the gearboxes' hysteresis may move the tip [m]."""
    step: Array
    """(...) the most that the motors' microstep error may move the tip [m]."""
    uncounted: tuple[str, ...]
    """What is left out for want of data, a phrase each."""

    @property
    def total(self) -> Array:
        """(...) the most that all of it can come to [m]: the parts' sizes added up."""
        size: Array = np.linalg.norm(self.wind_up, axis=-1)
        return size + self.backlash + self.hysteresis + self.step


def tip_deflection(boom: Boom, q: ArrayLike, tau: ArrayLike) -> TipDeflection:
    """The tip's displacement under joint torques (..., 5) [Nm], to first order: d = J_v dq.

    A gearbox yields to the load that its torque holds: dq_i = -wind_up(tau_i). Backlash, hysteresis and microstep error are
    widths whose signs nobody knows: each is the worst over all signs of |sum_i +-J_v,i b_i|.

    Raises:
        InputError: q or tau is not finite or not (..., 5), or they do not broadcast.
    """
    q, tau = broadcast(q=q, tau=tau)
    J = jacobian(boom, q)[..., :3, :]
    yields = np.zeros(tau.shape)
    widths = {"backlash": np.zeros(5), "hysteresis": np.zeros(5), "step": np.zeros(5)}
    uncounted = []
    for i, drive in enumerate(boom.drives):
        if drive is None:
            uncounted.append(f"{JOINTS[i]}: no drive data")
            continue
        angle = wind_up(drive.gearbox, tau[..., i])
        if angle is not None:
            yields[..., i] = -angle
        known = {"wind-up": angle, "backlash": drive.gearbox.backlash, "hysteresis": drive.gearbox.hysteresis}
        known["microstep error"] = step = _step_error(drive)
        uncounted += [f"{JOINTS[i]}: no {name} is printed" for name, value in known.items() if value is None]
        for name, value in zip(widths, (drive.gearbox.backlash, drive.gearbox.hysteresis, step), strict=True):
            widths[name][i] = value or 0.0
    moved = sum((J[..., i] * yields[..., i, None] for i, drive in enumerate(boom.drives) if drive), np.zeros(J.shape[:-1]))
    return TipDeflection(moved, **{name: _worst(J, width) for name, width in widths.items()}, uncounted=tuple(uncounted))


def gear_stiffness(drives: tuple[Drive | None, ...]) -> tuple[Array, Mask]:
    """Stiffness K1 of each joint's gearbox (5,) [Nm/rad], and which of them are known."""
    stiffness = [None if d is None or d.gearbox.torsion_stiffness is None else d.gearbox.torsion_stiffness[0] for d in drives]
    return np.array([k or 0.0 for k in stiffness]), np.array([k is not None for k in stiffness])


def gear_frequencies(boom: Boom, M: Array) -> Array | None:
    """Natural frequencies (..., k) [Hz], ascending, of the arm on its k gearboxes' first stiffness, other joints locked.

        det(K - (2 pi f)^2 M) = 0,  M (..., 5, 5) from `mass_matrix`.

    None where no gearbox prints its stiffness.
    """
    stiffness, known = gear_stiffness(boom.drives)
    if not known.any():
        return None
    root = 1.0 / np.sqrt(stiffness[known])
    inverse = np.linalg.eigvalsh(root[:, None] * M[..., known, :][..., :, known] * root)
    with np.errstate(divide="ignore"):  # a massless arm does not swing
        frequencies: Array = 1.0 / (2.0 * np.pi * np.sqrt(np.maximum(inverse[..., ::-1], 0.0)))
    return frequencies


def _step_error(drive: Drive) -> float | None:
    return None if drive.motor.microstep_accuracy is None else drive.motor.microstep_accuracy / drive.gearbox.ratio


def _worst(J: Array, widths: Array) -> Array:
    """max over signs of |sum_i +-J_i w_i| (...), J (..., 3, 5); the first sign is free."""
    moves = [J[..., i] * widths[i] for i in np.flatnonzero(widths)]
    if not moves:
        return np.zeros(J.shape[:-2])
    squares = []
    for signs in product((1.0, -1.0), repeat=len(moves) - 1):
        total = sum((sign * move for sign, move in zip(signs, moves[1:], strict=True)), moves[0])
        squares.append(np.square(total).sum(axis=-1))
    worst: Array = np.sqrt(np.maximum.reduce(squares))
    return worst
