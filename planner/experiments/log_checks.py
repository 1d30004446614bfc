"""Slips that a log of torques gives away: sign, unit, side of the gearbox, and late time stamps."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS, Boom, InputError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from planner.experiments.readings import Readings

if TYPE_CHECKING:
    from planner.experiments.identification import Identification

_SAMPLES = 4000
_SURE = 5.0  # standard deviations
_ALIKE = 2.5  # factor between a log and the boom's file that different masses may cause
_NEAR = 2.0  # factor within which a gain is taken for that of another unit
_NOTICED = 2e-3  # [s]


def require_plausible_torques(boom: Boom, logs: Sequence[Readings]) -> None:
    """Refuse torques that are not those of this boom's joints in Nm and N.

    Each joint's torques are fitted by gain tau_file + viscous qd + coulomb sign(qd) + constant, with the torques tau_file of
    the boom's file. A gain far from 1 that the log tells for sure is a slip.

    Raises:
        InputError: a gain is negative or a power of ten or a gear ratio away from 1. The message says what it looks like.
    """
    for i, joint in enumerate(JOINTS):
        gain, sigma = _gain(boom, logs, i)
        if abs(gain) < _SURE * sigma:
            continue
        unit = "N" if IS_LENGTH[i] else "Nm"
        if gain < 0.0:
            _refuse(i, gain, f"look turned round: they must be positive along the joint's coordinate (multiply tau{i + 1} by -1)")
        drive = boom.drives[i]
        slips = {
            1e-3: f"look like k{unit}; they must be in {unit}",
            1e3: f"look like m{unit}; they must be in {unit}",
        }
        if drive is not None:
            ratio = drive.gearbox.ratio
            slips |= {1.0 / ratio: f"look like those of the motor: multiply them by the gear ratio {ratio:g}",
                      1.0 / ratio / 1e3: f"look like the motor's in k{unit}: multiply them by {ratio * 1e3:g}"}  # fmt: skip
        for factor, meant in slips.items():
            if 1.0 / _NEAR < gain / factor < _NEAR:
                _refuse(i, gain, meant)
        if not 1.0 / _ALIKE < gain < _ALIKE:
            _refuse(i, gain, f"are neither in {unit} nor of this boom: check the unit, the gear ratio and --payload")


def _refuse(i: int, gain: float, meant: str) -> None:
    raise InputError(f"the torques of {JOINTS[i]} (tau{i + 1}) are {gain:.3g} times those of the boom's file: they {meant}")


def _gain(boom: Boom, logs: Sequence[Readings], joint: int) -> tuple[float, float]:
    """The gain of a joint and its standard deviation."""
    columns, right = [], []
    for log in logs:
        some = slice(None, None, max(1, len(log.t) * len(logs) // _SAMPLES))
        states = (log.q[some], log.qd[some], log.qdd[some])
        qd, used = states[1][:, joint], log.moving[some, joint]
        model = inverse_dynamics(boom, *states, reactions=False).tau[:, joint]
        columns.append(np.stack([model, qd, np.sign(qd), np.ones(len(qd))], axis=-1)[used])
        right.append(log.tau[some, joint][used])
    return _first_coefficient(np.concatenate(columns), np.concatenate(right))


def _first_coefficient(A: Array, b: Array) -> tuple[float, float]:
    """The first coefficient of a least squares fit and its standard deviation."""
    norms = np.linalg.norm(A, axis=0)
    if len(b) <= A.shape[1] or not (norms > 0.0).all():
        return 0.0, np.inf
    scaled = A / norms
    x, _, rank, _ = np.linalg.lstsq(scaled, b, rcond=1e-6)
    if rank < A.shape[1]:
        return 0.0, np.inf
    variance = float(np.sum((b - scaled @ x) ** 2)) / (len(b) - A.shape[1])
    sigma = np.sqrt(variance * np.linalg.inv(scaled.T @ scaled)[0, 0])
    return float(x[0] / norms[0]), float(sigma / norms[0])


def delay_notes(found: "Identification", logs: Sequence[Readings]) -> tuple[str, ...]:
    """Say that torques and positions seem to be stamped at different times.

    A torque that is stamped d too late is tau(t - d), about tau - d dtau/dt: the residual shows d.
    """
    slopes, left = [], []
    for log in logs:
        model = found.unknowns.torque(found.parameters, log)
        rate = np.gradient(model, log.step, axis=0)
        used = log.moving & (np.abs(np.gradient(np.sign(log.qd), axis=0)) == 0.0)
        weight = used / np.maximum(np.std(log.tau - model, axis=0), 1e-9)
        slopes.append((rate * weight).ravel())
        left.append(((model - log.tau) * weight).ravel())
    slope, r = np.concatenate(slopes), np.concatenate(left)
    energy = float(slope @ slope)
    if energy == 0.0:
        return ()
    delay = float(slope @ r) / energy
    sigma = float(np.sqrt(np.mean((r - delay * slope) ** 2) / energy))
    if abs(delay) < max(_NOTICED, _SURE * sigma):
        return ()
    way = "late" if delay > 0.0 else "early"
    return (f"the torques seem to be stamped {abs(delay) * 1e3:.1f} ms {way}: measure both with one clock",)
