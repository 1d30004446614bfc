"""Slips that a log gives away: units; sign and side of the gearbox of torques; late time stamps.

Where a joint's torque is mostly that of masses, its gain over the torque of the boom's file shows
the slip. Where friction hides the masses, two facts are left: friction brakes, and the torque is
not far smaller than the masses alone need.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from boom_model import JOINTS, Boom, InputError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from planner.experiments.readings import Readings

_SAMPLES = 4000
_EXPLAINED = 0.5  # share of the torque beside friction that the boom's file must explain, to judge by
_SURE = 5.0  # standard deviations
_ALIKE = 2.5  # factor between a log and the boom's file that different masses may cause
_NEAR = 2.0  # factor within which a gain is taken for that of another unit
_NOTICED = 2e-3  # [s]
_BEYOND = 0.25  # share of a joint's range by which a position may be outside of its limits
_FRICTION = 0.2  # share of the torque's power that friction must have, to judge by
_ONE_WAY = 0.8  # mean direction of a joint from which on it moves one way
_ROTOR = 0.2  # share of the noise that a rotor's torque must have for a note
_LEFT = 2.0  # times the noise that may stay unexplained without a note


def require_plausible_torques(boom: Boom, logs: Sequence[Readings], *, payload_known: bool = True) -> None:
    """Refuse torques that are not those of this boom's joints in Nm and N.

    Each joint's torques are fitted by gain tau_file + inertia qdd + viscous qd + coulomb sign(qd) +
    constant, with the torques tau_file of the boom's file. Where tau_file explains most of what the
    rest leaves, a gain far from 1 is a slip. If the payload is not known, only a gain like that of
    another sign or unit is.

    Raises:
        InputError: a gain is negative or a power of ten or a gear ratio away from 1. The message
            says what it looks like.
    """
    for i in range(len(JOINTS)):
        fit = _fitted(boom, logs, i)
        gain = fit.gain
        if fit.explained < _EXPLAINED:  # friction and noise hide what the masses do
            if payload_known and not fit.one_way:
                if fit.braking < -_SURE:
                    _turned(i, "friction drives the joint")
                _require_size(boom, fit, i)
            continue
        unit = "N" if IS_LENGTH[i] else "Nm"
        if gain < 0.0:
            _turned(i, f"they are {gain:.3g} times those of the boom's file")
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


def require_plausible_positions(boom: Boom, logs: Sequence[Readings]) -> None:
    """Refuse positions far outside of the limits, as degrees and millimetres are.

    Raises:
        InputError: a position is more than a quarter of the joint's range outside of its limits.
    """
    limits = boom.limits
    room = _BEYOND * (limits.upper - limits.lower)
    for log in logs:
        outside = (log.q < limits.lower - room) | (log.q > limits.upper + room)
        for i in np.flatnonzero(outside.any(axis=0)):
            at, unit = log.q[outside[:, i], i][0], "m" if IS_LENGTH[i] else "rad"
            raise InputError(
                f"{JOINTS[i]} (q{i + 1}) is {at:.4g}, far outside of its limits {limits.lower[i]:.4g} to {limits.upper[i]:.4g} "
                f"{unit}: positions must be in {unit}, along the boom's own coordinates (column q{i + 1})"
            )


def _require_size(boom: Boom, fit: "_Fit", i: int) -> None:
    """Refuse torques that are far smaller than the masses of the boom's file need."""
    if max(fit.size, fit.gain + _SURE * fit.deviation) < 1.0 / _ALIKE:
        unit, drive = "N" if IS_LENGTH[i] else "Nm", boom.drives[i]
        ratio = "" if drive is None else f" of ratio {drive.gearbox.ratio:g}"
        _refuse(i, fit.size, f"must be in {unit}, behind the gearbox{ratio}, and --payload what the boom carried")


def _turned(i: int, why: str) -> None:
    raise InputError(
        f"the torques of {JOINTS[i]} (tau{i + 1}) look turned round, because {why}: "
        f"they must be positive along the joint's coordinate (multiply tau{i + 1} by -1)"
    )


def _refuse(i: int, gain: float, meant: str) -> None:
    raise InputError(f"the torques of {JOINTS[i]} (tau{i + 1}) are {gain:.3g} times those of the boom's file: they {meant}")


class _Fit(NamedTuple):
    """Torques by gain tau_file + inertia qdd + viscous qd + coulomb sign(qd) + constant."""

    gain: float = 1.0
    deviation: float = np.inf
    """of the gain, for noise that is white"""
    explained: float = 0.0
    """Share of the torque beside friction and drive inertia that tau_file explains."""
    braking: float = 0.0
    """Power of friction, as `_braking` says."""
    size: float = 1.0
    """RMS of the torques by that of tau_file."""
    one_way: bool = True
    """Whether the joint moves one way; a constant torque is then like dry friction."""


def _fitted(boom: Boom, logs: Sequence[Readings], joint: int) -> _Fit:
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
        return _Fit()
    model, tau = (x - A[:, 1:] @ np.linalg.lstsq(A[:, 1:], x, rcond=None)[0] for x in (A[:, 0], b))
    energy, whole = float(model @ model), float(A[:, 0] @ A[:, 0])
    if energy <= 1e-12 * whole or not tau.any():
        return _Fit()
    gain = float(model @ tau) / energy
    return _Fit(
        gain=gain,
        deviation=float(np.linalg.norm(tau - gain * model)) / np.sqrt(len(b) * energy),
        explained=gain**2 * energy / float(tau @ tau),
        braking=_braking(A, b),
        size=float(np.sqrt(b @ b / whole)),
        one_way=abs(float(A[:, 3].mean())) > _ONE_WAY,
    )


def _braking(A: Array, b: Array) -> float:
    """Return the power of friction, A's columns 2 and 3, by its standard deviation; 0 if small."""
    scale = np.maximum(np.abs(A).max(axis=0), 1e-300)
    inverse = np.linalg.pinv(A / scale)
    x, speed = inverse @ b, np.abs(A[:, 2])
    power = np.array([0.0, 0.0, float(speed @ speed) / scale[2], float(speed.sum()) / scale[3], 0.0])
    left = b - (A / scale) @ x
    deviation = np.sqrt(float(left @ left) / len(b)) * float(np.linalg.norm(power @ inverse))
    spent = float(power @ x)
    small = abs(spent) < _FRICTION * float(np.abs(b * A[:, 2]).sum())
    return 0.0 if small or deviation == 0.0 else spent / deviation


def rotor_notes(left: Array, qdd: Array, noise: Array) -> tuple[str, ...]:
    """Say which joints' unexplained torques (n, 5) follow their accelerations, as motors' do."""
    energy = np.maximum((qdd**2).sum(axis=0), 1e-300)
    inertia = (left * qdd).sum(axis=0) / energy
    sure = inertia * np.sqrt(energy) > _SURE * left.std(axis=0)
    names = [JOINTS[i] for i in np.flatnonzero(sure & (inertia * np.sqrt(energy / len(qdd)) > _ROTOR * noise))]
    if not names:
        return ()
    return (f"unexplained torque of {', '.join(names)} follows the acceleration: torques of motors need --drive-inertia",)


def residual_notes(after: Array, noise: Array) -> tuple[str, ...]:
    """Say which joints' torques (5,) stay unexplained far beyond their noise."""
    names = [f"{JOINTS[i]} ({after[i] / noise[i]:.1f} times the noise)" for i in np.flatnonzero(after > _LEFT * noise)]
    if not names:
        return ()
    return (
        f"much stays unexplained of {', '.join(names)}: look for swapped columns, single wrong samples, "
        "motor torques without --drive-inertia, and friction that changes with load or temperature",
    )


def delay_notes(delay: float, deviation: float) -> tuple[str, ...]:
    """Say that torques and positions seem to be stamped at different times.

    `delay` [s] is judged by its standard deviation `deviation` [s].
    """
    if abs(delay) < max(_NOTICED, _SURE * deviation):
        return ()
    way = "late" if delay > 0.0 else "early"
    return (f"the torques seem to be stamped {abs(delay) * 1e3:.0f} ms {way}: measure both with one clock",)
