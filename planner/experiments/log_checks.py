"""Slips that a log of torques gives away: sign, unit, side of the gearbox, and late time stamps."""

from collections.abc import Sequence

import numpy as np

from boom_model import JOINTS, Boom, InputError, inverse_dynamics
from boom_model.boom import IS_LENGTH
from planner.experiments.readings import Readings

_SAMPLES = 4000
_EXPLAINED = 0.5  # share of the torque beside friction that the boom's file must explain, to judge by
_SURE = 5.0  # standard deviations
_ALIKE = 2.5  # factor between a log and the boom's file that different masses may cause
_NEAR = 2.0  # factor within which a gain is taken for that of another unit
_NOTICED = 2e-3  # [s]


def require_plausible_torques(boom: Boom, logs: Sequence[Readings], *, payload_known: bool = True) -> None:
    """Refuse torques that are not those of this boom's joints in Nm and N.

    Each joint's torques are fitted by gain tau_file + inertia qdd + viscous qd + coulomb sign(qd) + constant, with the torques
    tau_file of the boom's file. Where tau_file explains most of what the rest leaves, a gain far from 1 is a slip. If the
    payload is not known, only a gain like that of another sign or unit is.

    Raises:
        InputError: a gain is negative or a power of ten or a gear ratio away from 1. The message says what it looks like.
    """
    for i in range(len(JOINTS)):
        gain, explained = _gain(boom, logs, i)
        if explained < _EXPLAINED:
            continue  # friction and noise hide what the masses do
        unit = "N" if IS_LENGTH[i] else "Nm"
        if gain < 0.0:
            _refuse(
                i, gain, f"look turned round: they must be positive along the joint's coordinate (multiply tau{i + 1} by -1)"
            )
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
        if payload_known and not 1.0 / _ALIKE < gain < _ALIKE:
            _refuse(i, gain, f"are neither in {unit} nor of this boom: check the unit, the gear ratio and --payload")


def _refuse(i: int, gain: float, meant: str) -> None:
    raise InputError(f"the torques of {JOINTS[i]} (tau{i + 1}) are {gain:.3g} times those of the boom's file: they {meant}")


def _gain(boom: Boom, logs: Sequence[Readings], joint: int) -> tuple[float, float]:
    """The gain of a joint, and the share of the torque beside friction and drive inertia that it explains."""
    columns, right = [], []
    for log in logs:
        some = slice(None, None, max(1, len(log.t) * len(logs) // _SAMPLES))
        states = (log.q[some], log.qd[some], log.qdd[some])
        qd, qdd, used = states[1][:, joint], states[2][:, joint], log.moving[some, joint]
        model = inverse_dynamics(boom, *states, reactions=False).tau[:, joint]
        columns.append(np.stack([model, qdd, qd, np.sign(qd), np.ones(len(qd))], axis=-1)[used])
        right.append(log.tau[some, joint][used])
    A, b = np.concatenate(columns), np.concatenate(right)
    if len(b) <= 2 * A.shape[1]:
        return 1.0, 0.0
    model, tau = (x - A[:, 1:] @ np.linalg.lstsq(A[:, 1:], x, rcond=None)[0] for x in (A[:, 0], b))
    energy = float(model @ model)
    if energy <= 1e-12 * float(A[:, 0] @ A[:, 0]) or not tau.any():
        return 1.0, 0.0
    gain = float(model @ tau) / energy
    return gain, gain**2 * energy / float(tau @ tau)


def delay_notes(delay: float, deviation: float) -> tuple[str, ...]:
    """Say that torques and positions seem to be stamped at different times, by a delay [s] and its standard deviation."""
    if abs(delay) < max(_NOTICED, _SURE * deviation):
        return ()
    way = "late" if delay > 0.0 else "early"
    return (f"the torques seem to be stamped {abs(delay) * 1e3:.0f} ms {way}: measure both with one clock",)
