"""Logs for identification: evenly sampled, low-pass filtered without delay, and differentiated.

Positions pass a Butterworth filter of fourth order forwards and backwards, so that nothing is
delayed. Central differences of the filtered positions give velocities and accelerations. Torques
are not filtered: their noise averages out in the fit.

A narrow filter distorts the motion. A wide one passes noise, and noise in the accelerations makes
the fit underestimate inertias by the ratio of the variances. The filter is therefore as narrow as
the log allows: it removes noise alone. What noise it passes is known, and the fit takes it into
account.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Boom, InputError
from boom_model.arrays import Array, Mask, checked, read_only
from boom_model.boom import IS_LENGTH
from planner.experiments.comparison import Log, evenly_sampled, read_log

CUTOFFS = (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
"""Cut-off frequencies [Hz] that are tried, the narrowest first."""

LONGEST_GAP = 0.1
"""Longest gap [s] of a log that is interpolated."""

_SLOWEST = 0.05  # [s] between samples

_ORDER = 4
_REMOVED = 1.2  # a filter may remove this many times the variance of the noise
_ROUNDING = 1e-6  # [rad, m] resolution below which a position has no noise to tell
_SLOW = 0.03  # share of its largest speed below which a joint may stick
_SIGMAS = 4.0
_SMEARED = 0.6  # share of 1 / cutoff over which the filter smears a change of direction
_FEWEST = 40
_LEAST_MOTION = 1e-3  # [rad, m]
_ABOVE_NOISE = 1.5  # times the span of noise alone, about 2 sigma sqrt(2 ln n), that a motion must have


@dataclass(frozen=True, eq=False)
class Readings:
    """States and torques of a log at even steps."""

    t: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    """(n, 5) torques at the joints [Nm, the extension's N]"""
    moving: Mask
    """(n, 5) True where a joint is fast enough for its friction to have a known direction."""
    cutoff: float
    """Cut-off frequency of the filter [Hz]."""
    position_noise: Array
    """(5,) standard deviation of the noise of the positions [rad, m]"""
    torque_noise: Array
    """(5,) standard deviation of the noise of the torques from sample to sample [Nm, N]"""
    filtered: bool
    """Whether the accelerations come from the filtered positions; otherwise the log has them."""
    notes: tuple[str, ...]

    @property
    def step(self) -> float:
        """Time between two samples [s]."""
        return float(self.t[-1] - self.t[0]) / (len(self.t) - 1)

    def acceleration_variance(self, block: float) -> Array:
        """Variance (5,) of the noise of accelerations, averaged over blocks of `block` seconds.

        White noise of variance v per sample of step h, through the filter's gain 1 / (1 + (f /
        fc)^8), two differentiations and the mean over T:

            2 h v integral of (2 pi f)^4 (sin(pi f T) / (pi f T))^2 / (1 + (f / fc)^8)^2 df
        """
        if not self.filtered:
            return np.zeros(5)
        f = np.linspace(0.0, min(3.0 * self.cutoff, 0.5 / self.step), 600)
        gain = (2.0 * np.pi * f) ** 4 * np.sinc(f * block) ** 2 / (1.0 + (f / self.cutoff) ** (2 * _ORDER)) ** 2
        return np.asarray(2.0 * self.step * self.position_noise**2 * np.trapezoid(gain, f))

    def calibrated(self, boom: Boom) -> "Readings":
        """Return the joint positions in the place of readings, where the boom is calibrated."""
        known = boom.calibration
        if known is None:
            return self
        note = f"offsets and scale of the readings are applied: {known.origin.source}"
        return replace(
            self,
            q=known.joint_positions(self.q),
            qd=known.scale * self.qd,
            qdd=known.scale * self.qdd,
            position_noise=known.scale * self.position_noise,
            notes=(*self.notes, note),
        )

    def part(self, samples: slice) -> "Readings":
        """Return some of the samples."""
        names = ("t", "q", "qd", "qdd", "tau", "moving")
        return replace(self, **{name: getattr(self, name)[samples] for name in names})


def read_torque_log(path: str | Path, torque_per_ampere: ArrayLike | None = None) -> Log:
    """Read a log with torques or motor currents from CSV or Parquet.

    The columns are t, q1..q5, tau1..tau5 and any of qd1..qd5 and qdd1..qdd5.

    Args:
        path: the file.
        torque_per_ampere: (5,) motor constant times gear ratio [Nm/A, the extension's N/A];
            tau1..tau5 are then currents [A]. None takes them as torques at the joints.

    Raises:
        InputError: as `read_log`, or there are no torques.
    """
    log = read_log(path)
    if log.tau is None:
        raise InputError(f"{path}: the log has no torques: measure tau1..tau5, at the joints or as motor currents")
    if torque_per_ampere is None:
        return log
    return replace(log, tau=read_only(log.tau * checked("torque per ampere", torque_per_ampere, 5)))


def readings_of(log: Log, cutoff: float | None = None, *, every_joint: bool = True) -> Readings:
    """Return a log's states and torques, with filtered positions and their derivatives.

    Args:
        log: positions and torques. Velocities and accelerations are used as given if both exist.
        cutoff: of the filter [Hz]. None selects the narrowest that removes noise alone.
        every_joint: whether every joint must move, as a fit needs it.

    Raises:
        InputError: there are no torques or fewer than 40 samples, samples are too far apart or a
            gap is too long, a joint does not move beyond its noise, a torque never changes, or the
            cut-off is not below half the sampling rate. The message says what to measure instead.
    """
    if log.tau is None:
        raise InputError("the log has no torques: measure tau1..tau5, at the joints or as motor currents")
    if len(log.t) < _FEWEST:
        raise InputError(f"the log has {len(log.t)} samples; measure at least {_FEWEST}, better 20 s at 100 Hz or more")
    steps = np.diff(log.t)
    if (usual := float(np.median(steps))) > _SLOWEST:
        raise InputError(
            f"the log has a sample every {usual:.4g} s; measure every {_SLOWEST:g} s or better 0.01 s, and give t in seconds"
        )
    if steps.max() > LONGEST_GAP:
        at = int(steps.argmax())
        raise InputError(
            f"the log has a gap of {steps[at]:.4g} s after t = {log.t[at]:g} s, longer than {LONGEST_GAP:g} s; "
            "measure without gaps, or cut the log there and give both parts"
        )
    even = evenly_sampled(log, LONGEST_GAP)
    tau, h = even.tau, float(even.t[-1] - even.t[0]) / (len(even.t) - 1)
    assert tau is not None
    noise = np.maximum(_noise(even.q), _ROUNDING)
    if every_joint:
        _require_motion(even.q, noise)
    _require_torques(tau)
    if cutoff is not None and not 0.0 < cutoff < 0.5 / h:
        raise InputError(f"cutoff is {cutoff:g} Hz; it must be between 0 and {0.5 / h:g} Hz, half the log's sampling rate")
    usable = [cutoff] if cutoff is not None else [f for f in CUTOFFS if f < 0.4 / h] or [0.4 / h]
    for used in usable:
        q = _low_pass(even.q, h, used)
        moving = _moving(np.gradient(q, h, axis=0), noise, h, used)
        edge = max(1, int(min(1.0 / used, 0.25 * (even.t[-1] - even.t[0])) / h))
        inside = moving & (np.abs(np.arange(len(q)) - 0.5 * (len(q) - 1)) < 0.5 * len(q) - edge)[:, None]
        removed = np.sum((even.q - q) ** 2 * inside, axis=0)
        if (removed <= _REMOVED * noise**2 * inside.sum(axis=0)).all():
            break
    filtered = even.qd is None or even.qdd is None
    if even.qd is not None and even.qdd is not None:
        q, qd, qdd, edge = even.q, even.qd, even.qdd, 0
    else:
        qd, qdd = np.gradient(q, h, axis=0), np.zeros_like(q)
        qdd[1:-1] = np.diff(q, 2, axis=0) / h**2
    notes = (*even.notes, f"positions are low-pass filtered at {used:g} Hz, forwards and backwards")
    whole = Readings(even.t, q, qd, qdd, tau, moving, used, noise, _noise(tau), filtered, notes)
    return whole.part(slice(edge, len(q) - edge))


def _moving(qd: Array, noise: Array, step: float, cutoff: float) -> Mask:
    """Return where a joint moves (n, 5), except where the filter smears a change of direction."""
    from scipy.ndimage import binary_erosion

    speed_noise = noise * 2.0 * np.pi * cutoff * np.sqrt(2.0 * cutoff * step / 3.0)
    fast = np.abs(qd) > np.maximum(_SLOW * np.abs(qd).max(axis=0), _SIGMAS * speed_noise)
    reach = int(_SMEARED / (cutoff * step))
    kept: Mask = binary_erosion(fast, np.ones((2 * reach + 1, 1), dtype=bool), border_value=1)
    return kept


def _noise(values: Array) -> Array:
    """Return the standard deviation (5,) of noise that is independent from sample to sample.

    It is found by third differences. The median of the absolute values is used: a step in the
    torque does not count as noise.
    """
    differences: Array = np.median(np.abs(np.diff(values, 3, axis=0)), axis=0) / 0.6745 / np.sqrt(20.0)
    return differences


def _low_pass(values: Array, step: float, cutoff: float) -> Array:
    from scipy.signal import butter, sosfiltfilt

    sections = butter(_ORDER, cutoff, fs=1.0 / step, output="sos")
    padding = min(len(values) - 1, int(1.0 / (cutoff * step)))
    passed: Array = sosfiltfilt(sections, values, axis=0, padlen=padding)
    return passed


def _require_torques(tau: Array) -> None:
    constant = [f"{JOINTS[i]} (tau{i + 1} = {tau[0, i]:g})" for i, span in enumerate(np.ptp(tau, axis=0)) if span == 0.0]
    if constant:
        raise InputError(f"these torques never change: {', '.join(constant)}; measure them: is a sensor not read?")


def _require_motion(q: Array, noise: Array) -> None:
    least = np.maximum(_LEAST_MOTION, _ABOVE_NOISE * 2.0 * np.sqrt(2.0 * np.log(len(q))) * noise)
    still = [i for i, span in enumerate(np.ptp(q, axis=0)) if span < least[i]]
    if still:
        span = {i: f"{np.ptp(q[:, i]):.2g} {'m' if IS_LENGTH[i] else 'rad'}" for i in still}
        named = ", ".join(f"{JOINTS[i]} ({span[i]})" for i in still)
        raise InputError(
            f"these joints do not move: {named}; their friction and inertia stay unknown. "
            "Measure a motion of all joints, as boom identify --design writes"
        )
