"""Comparison of a measured motion with its plan: joint errors, tip errors and torques.

A log contains positions. It may also contain velocities, accelerations and torques. Encoders are
noisy, and two differentiations amplify the noise of a step h by about 1/h^2. Derivatives that a log
lacks are therefore taken from a Savitzky-Golay filter: it fits a cubic to the samples in a window
around each sample, and differentiates the cubic in the middle of the window. The filter assumes
that the motion is a cubic within any window, and that the noise of different samples is
independent. It is a weighted sum with weights w, so it turns noise of standard deviation sigma into
noise of

    sigma sqrt(sum w^2),    about sigma sqrt(720 / N^5) / h^2 for accelerations from N positions.

The effect on the torques follows from the derivatives of the torques by q, qd and qdd; the last of
them is M(q). A wider window passes less noise, but distorts the motion more.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Basis, Boom, InputError, forward_kinematics, inverse_dynamics
from boom_model.arrays import Array, Mask, checked, read_only, scalar
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from boom_model.dynamics.newton_euler import PayloadAs
from planner.motion.motion_files import read_quantities
from planner.motion.trajectory import Trajectory
from planner.planning import torques

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

WINDOW = 0.2
"""Default width of the smoothing window [s].

This is our own choice: one twentieth of the main move.
"""

_ORDER = 3
_NOTICED = 1e-3  # [s] an offset of the log that is told
_NOTHING = 1e-9  # [rad, m, Nm, N]
_EVEN = 0.01  # steps that differ by less than this fraction count as even
_SHIFTS = 50_000  # largest number of shifts on the grid of the alignment
_ALIGNMENT_SAMPLES = 20_000  # samples of a log that the final alignment uses
_DIFFERENCE = 1e-5
_NOISE_SAMPLES = 200  # samples at which the torque noise is computed


@dataclass(frozen=True, eq=False)
class Log:
    """A measured motion at times t (n,) in rad, m and s.

    Each other field is (n, 5), or None if not measured.
    """

    t: Array
    q: Array
    qd: Array | None = None
    qdd: Array | None = None
    tau: Array | None = None
    """Torques at the joints, behind the gearboxes [Nm, the extension's N]."""
    notes: tuple[str, ...] = ()

    @staticmethod
    def of(
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        notes: tuple[str, ...] = (),
    ) -> "Log":
        """Return a log of checked arrays.

        Raises:
            InputError: a value is not finite, the shapes do not match, there is no sample, or the
                times do not increase.
        """
        some = {"qd": qd, "qdd": qdd, "tau": tau}
        given = {name: checked(name, values, 5) for name, values in some.items() if values is not None}
        plain = Trajectory.from_samples(t, q, np.zeros(np.shape(q)), np.zeros(np.shape(q)))
        for name, values in given.items():
            if values.shape != plain.q.shape:
                raise InputError(f"{name} has shape {values.shape}; with {plain.t.size} times it must be {plain.q.shape}")
        return Log(plain.t, plain.q, notes=notes, **{name: read_only(values) for name, values in given.items()})


def read_log(path: str | Path) -> Log:
    """Read a log from CSV or Parquet: t, q1..q5, and any of qd1..qd5, qdd1..qdd5 and tau1..tau5.

    Raises:
        InputError: as `read_motion`, except that qd may be given without qdd.
    """
    data, notes = read_quantities(path)
    try:
        return Log.of(**data, notes=notes)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A log with the derivatives that it lacked."""

    trajectory: Trajectory
    """The motion.

    Its positions are those of the log; its notes say how the derivatives were found.
    """
    tau: Array | None
    """Torques of the log."""
    noise: Array
    """(5,) standard deviation of the position noise, from what the filter removes [rad, m]"""
    covariance: Array
    """(5, 3, 3) covariance of the noise of q, qd and qdd of each joint.

    It is 0 for a qd or qdd that the log contains.
    """
    inside: Mask
    """(n,) True where the whole window lies in the log; the derivatives are worse near its ends."""


def smoothed(log: Log, window: float = WINDOW) -> Smoothed:
    """Return the log with all derivatives.

    Derivatives that the log contains are kept. Velocities are computed from the positions, and
    accelerations from the velocities of the log or else from its positions, by a cubic
    Savitzky-Golay filter over `window` seconds. A log whose steps differ by more than 1 % is first
    resampled at even steps by linear interpolation.

    Raises:
        InputError: the window is not a positive number, contains fewer than 5 samples or more than
            the log has, or is shorter than a gap in the log.
    """
    from scipy.signal import savgol_coeffs, savgol_filter

    window = scalar("window", window)
    if not window > 0.0:
        raise InputError(f"window is {window:g} s; it must be above 0 s")
    log = evenly_sampled(log, window)
    n = log.t.size
    h = float(log.t[-1] - log.t[0]) / max(n - 1, 1)
    N = 2 * round(min(0.5 * window / h, n)) + 1 if h > 0.0 else 1
    if N < _ORDER + 2:
        raise InputError(f"a window of {window:g} s contains {N} samples of a log with steps of {h:g} s; it needs at least 5")
    if n < N:
        raise InputError(f"the log has {n} samples; a window of {window:g} s needs {N}")

    def derivative(values: Array, order: int) -> Array:
        found: Array = savgol_filter(values, N, _ORDER, deriv=order, delta=h, axis=0)
        return found

    def spread(values: Array) -> Array:
        kept = float(savgol_coeffs(N, _ORDER)[N // 2])  # share of its own noise that a smoothed sample keeps
        removed = (values - derivative(values, 0))[inside]
        rms: Array = np.sqrt(np.mean(removed**2, axis=0) / (1.0 - kept))
        return rms

    inside = np.zeros(n, dtype=bool)
    inside[N // 2 : n - N // 2] = True
    noise, by_filter = spread(log.q), f"by a cubic Savitzky-Golay filter over {N} samples ({(N - 1) * h:.4g} s)"
    notes, qd, qdd = list(log.notes), log.qd, log.qdd
    weights = np.zeros((3, N))  # weights of the positions of a window in q, qd and qdd
    weights[0, N // 2] = 1.0
    rates = savgol_coeffs(N, _ORDER, deriv=1, delta=h, use="dot")
    from_velocities = np.zeros(5)
    if qd is None:
        qd, weights[1] = derivative(log.q, 1), rates
        notes.append(f"the log has no velocities; they are computed from its positions {by_filter}")
    if qdd is None and log.qd is None:
        qdd, weights[2] = derivative(log.q, 2), savgol_coeffs(N, _ORDER, deriv=2, delta=h, use="dot")
        notes.append(f"the log has no accelerations; they are computed from its positions {by_filter}")
    elif qdd is None:
        qdd, from_velocities = derivative(qd, 1), spread(qd) * np.linalg.norm(rates)
        notes.append(f"the log has no accelerations; they are computed from its velocities {by_filter}")
    covariance = noise[:, None, None] ** 2 * (weights @ weights.T)
    covariance[:, 2, 2] += from_velocities**2
    if log.qd is not None and log.qdd is not None:
        inside[:] = True
    trajectory = Trajectory.from_samples(log.t, log.q, qd, qdd, notes=tuple(notes))
    return Smoothed(trajectory, log.tau, noise, covariance, inside)


def evenly_sampled(log: Log, window: float) -> Log:
    """Return a log whose steps differ by less than 1 %, resampled by linear interpolation if not.

    Raises:
        InputError: a gap is longer than `window` [s].
    """
    steps = np.diff(log.t)
    if not steps.size or np.ptp(steps) <= _EVEN * steps.mean():
        return log
    if steps.max() > window:
        at = int(steps.argmax())
        raise InputError(
            f"the log has a gap of {steps[at]:g} s after t = {log.t[at]:g} s, longer than the window of {window:g} s"
        )
    t = np.linspace(log.t[0], log.t[-1], log.t.size)
    given = {name: values for name in ("q", "qd", "qdd", "tau") if (values := getattr(log, name)) is not None}
    read = {name: np.stack([np.interp(t, log.t, column) for column in values.T], axis=-1) for name, values in given.items()}
    spread = f"{steps.min():.4g} s to {steps.max():.4g} s"
    note = f"the steps of the log are uneven ({spread}); it is resampled linearly every {steps.mean():.4g} s"
    return Log(t, notes=(*log.notes, note), **read)


def _calibrated(boom: Boom, log: Log) -> Log:
    """Return the log with joint positions in place of readings, where the boom is calibrated."""
    known = boom.calibration
    if known is None:
        return log
    rates = {name: known.scale * values for name, values in (("qd", log.qd), ("qdd", log.qdd)) if values is not None}
    note = f"offsets and scale of the readings are applied: {known.origin.source}"
    return replace(log, q=read_only(known.joint_positions(log.q)), notes=(*log.notes, note), **rates)


@dataclass(frozen=True, eq=False)
class Comparison:
    """A plan and a log of it at common times: the times of the log that lie within the plan."""

    boom: Boom
    planned: Trajectory
    """The plan at the common times, which are counted on the clock of the plan."""
    measured: Trajectory
    """The log at the common times, with its derivatives."""
    offset: float
    """Time added to the times of the log [s]."""
    best_offset: float
    """The offset that fits best [s].

    It minimises the sum of squared joint errors, each joint relative to its range.
    """
    tau_planned: Array
    """(n, 5) torques of the plan, from the model"""
    tau_measured: Array
    """(n, 5) torques of the measured motion, from the model"""
    tau_logged: Array | None
    """(n, 5) measured torques"""
    tip_planned: Array
    """(n, 3) in frame 1 [m]"""
    tip_measured: Array
    """(n, 3)"""
    noise: Array
    """(5,) noise of the positions of the log, see `Smoothed`"""
    torque_noise: Array
    """(5,) standard deviation of tau_measured caused by the noise of the log.

    Differences smaller than this may be noise.
    """
    inside: Mask
    """(n,) True where tau_measured has that accuracy; peaks and means are taken there."""

    @property
    def joint_error(self) -> Array:
        """Measured minus planned positions, (n, 5)."""
        return self.measured.q - self.planned.q

    @property
    def tip_error(self) -> Array:
        """Distance between the two tips, (n,) [m]."""
        error: Array = np.linalg.norm(self.tip_measured - self.tip_planned, axis=-1)
        return error

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the plan, the log and the assumed friction."""
        given = zip(JOINTS, self.boom.friction.origins, strict=True)
        assumed = [(joint, origin) for joint, origin in given if origin is not None and origin.basis is Basis.ASSUMED]
        return (
            *(f"plan: {note}" for note in self.planned.notes),
            *(f"log: {note}" for note in self.measured.notes),
            *(f"the friction of {joint} is assumed: {origin.source}" for joint, origin in assumed),
        )

    def to_json(self, files: dict[str, str]) -> dict[str, Any]:
        """Return the JSON object of `boom compare`, in SI."""
        t, tip = self.planned.t, self.tip_error
        at = int(tip.argmax())
        everywhere = np.ones(len(t), dtype=bool)
        joints = []
        for i, joint in enumerate(JOINTS):
            torque: dict[str, Any] = {
                "unit": LOAD_UNITS[i],
                "noise": float(self.torque_noise[i]),
                "measured_less_planned": _extremes(t, (self.tau_measured - self.tau_planned)[:, i], self.inside),
                "logged_less_measured": None,
            }
            if self.tau_logged is not None:
                torque["logged_less_measured"] = _extremes(t, (self.tau_logged - self.tau_measured)[:, i], self.inside)
            position = {"unit": "m" if IS_LENGTH[i] else "rad", "noise": float(self.noise[i])}
            error = _extremes(t, self.joint_error[:, i], everywhere)
            joints.append({"joint": joint, "position": position | {"error": error}, "torque": torque})
        return {
            "offset_s": self.offset,
            "best_offset_s": self.best_offset,
            "samples": len(t),
            "from_s": float(t[0]),
            "to_s": float(t[-1]),
            "tip": {
                "peak_m": float(tip[at]),
                "at_s": float(t[at]),
                "planned_m": self.tip_planned[at].tolist(),
                "measured_m": self.tip_measured[at].tolist(),
                "rms_m": float(np.sqrt(np.mean(tip**2))),
                "mean_m": (self.tip_measured - self.tip_planned).mean(axis=0).tolist(),
            },
            "joints": joints,
            "notes": list(self.notes),
            "files": files,
        }


def compare(
    boom: Boom,
    planned: Trajectory,
    log: Log,
    *,
    offset: float | None = 0.0,
    window: float = WINDOW,
    payload_as: PayloadAs = "mass",
) -> Comparison:
    """Compare a plan with a log, at the times of the log that lie within the plan.

    The plan is interpolated: q by the cubic through its positions and velocities, qd by the
    derivative of that cubic, and qdd linearly. The torques are those of `torques`: on level ground,
    with friction where it is known, and without the drives' own inertia.

    Args:
        boom: the boom.
        planned: the plan.
        log: the measured motion.
        offset: added to the times of the log [s]. None selects the offset that fits best, which
            also removes a delay of the drives.
        window: see `smoothed`.
        payload_as: see `inverse_dynamics`.

    Raises:
        InputError: as `smoothed`; the plan has a single sample; or log and plan have fewer than two
            samples in common.
    """
    if planned.t.size < 2:
        raise InputError("the plan has a single sample; it needs at least 2")
    ready = smoothed(_calibrated(boom, log), window)
    curve = _curve(planned)
    best = _best_offset(boom, planned, curve, ready.trajectory)
    offset = best if offset is None else scalar("offset", offset)
    t = ready.trajectory.t + offset
    common = (t >= planned.t[0]) & (t <= planned.t[-1])
    if common.sum() < 2:
        raise InputError(
            f"the log ({t[0]:g} to {t[-1]:g} s with its offset of {offset:g} s) and the plan ({planned.t[0]:g} to "
            f"{planned.t[-1]:g} s) have fewer than two samples in common; the offset that fits best is {best:g} s"
        )
    t = t[common]
    qdd = np.stack([np.interp(t, planned.t, column) for column in planned.qdd.T], axis=-1)
    plan = Trajectory.from_samples(t, curve(t), curve(t, 1), qdd, notes=planned.notes)
    source = ready.trajectory
    measured = Trajectory.from_samples(t, source.q[common], source.qd[common], source.qdd[common], notes=source.notes)
    return Comparison(
        boom=boom,
        planned=plan,
        measured=measured,
        offset=offset,
        best_offset=best,
        tau_planned=torques(boom, plan, payload_as),
        tau_measured=torques(boom, measured, payload_as),
        tau_logged=None if ready.tau is None else ready.tau[common],
        tip_planned=forward_kinematics(boom, plan.q).position,
        tip_measured=forward_kinematics(boom, measured.q).position,
        noise=ready.noise,
        torque_noise=_torque_noise(boom, plan, ready.covariance, payload_as),
        inside=ready.inside[common],
    )


POSITION_HEADER = ("joint", "largest error", "at", "RMS", "mean", "noise")
TORQUE_HEADER = ("joint", "largest", "at", "RMS", "noise")
LOGGED_HEADER = ("joint", "largest", "at", "RMS")
ANSWER_HEADER = ("joint", "largest error", "at", "RMS", "torque differs", "log differs")
"""Columns of `answer_cells`: the torque of the measured motion less the plan's, and the log's less
the model's."""


def answer_cells(joint: dict[str, Any]) -> tuple[str, ...]:
    """Return a joint of `Comparison.to_json` as table cells under ANSWER_HEADER."""
    return *position_cells(joint)[:4], torque_cells(joint)[1], logged_cells(joint)[1]


def position_cells(joint: dict[str, Any]) -> tuple[str, ...]:
    """Return a joint of `Comparison.to_json` as table cells under POSITION_HEADER."""
    position = joint["position"]
    error = position["error"]
    factor, unit = (1e3, "mm") if position["unit"] == "m" else (180.0 / np.pi, "deg")
    shown = [
        f"{_above_rounding(value) * factor:.4g} {unit}"
        for value in (error["peak"], error["rms"], error["mean"], position["noise"])
    ]
    return joint["joint"], shown[0], f"{error['at_s']:.3f} s", *shown[1:]


def torque_cells(joint: dict[str, Any]) -> tuple[str, ...]:
    """Return a joint of `Comparison.to_json` as table cells under TORQUE_HEADER."""
    torque = joint["torque"]
    return *_torque_cells(joint, "measured_less_planned"), f"{torque['noise']:.3g} {torque['unit']}"


def logged_cells(joint: dict[str, Any]) -> tuple[str, ...]:
    """Return a joint of `Comparison.to_json` as table cells under LOGGED_HEADER."""
    return _torque_cells(joint, "logged_less_measured")


def _torque_cells(joint: dict[str, Any], difference: str) -> tuple[str, ...]:
    found, unit = joint["torque"][difference], joint["torque"]["unit"]
    if found is None or found["peak"] is None:
        return joint["joint"], "-", "-", "-"
    peak, rms = (f"{_above_rounding(found[name]):.4g} {unit}" for name in ("peak", "rms"))
    return joint["joint"], peak, f"{found['at_s']:.3f} s", rms


def _above_rounding(value: float) -> float:
    """Return the value, or 0 if it is rounding only."""
    return value if abs(value) > _NOTHING else 0.0


def summary(answer: dict[str, Any]) -> list[str]:
    """Return `Comparison.to_json` in sentences: the largest tip error, and the log's offset."""
    tip, late = answer["tip"], answer["offset_s"] - answer["best_offset_s"]
    where = ", ".join(f"{x:.3f}" for x in tip["planned_m"])
    found = [
        f"tip error at most {tip['peak_m'] * 1e3:.2f} mm, at {tip['at_s']:.3f} s near ({where}) m; "
        f"RMS {tip['rms_m'] * 1e3:.2f} mm"
    ]
    if abs(late) > _NOTICED:
        found.append(f"the log is {abs(late):.4f} s {'late' if late > 0.0 else 'early'}: --offset best takes that out")
    return found


def _curve(planned: Trajectory) -> "CubicHermiteSpline":
    from scipy.interpolate import CubicHermiteSpline

    return CubicHermiteSpline(planned.t, planned.q, planned.qd)


def _best_offset(boom: Boom, planned: Trajectory, curve: "CubicHermiteSpline", measured: Trajectory) -> float:
    """Return the offset that minimises the sum of squared errors, each joint relative to its range.

    The plan is at rest before its start and after its end. For every shift k on a grid, the cost
    follows from a correlation:

        sum_i (q_i - p_i+k)^2 = sum q_i^2 - 2 sum q_i p_i+k + sum p_i+k^2.

    The search continues around the best shift of the grid.
    """
    from scipy.optimize import minimize_scalar
    from scipy.signal import correlate

    weight = 1.0 / np.maximum(boom.limits.upper - boom.limits.lower, 1e-9)
    start, end = planned.t[[0, -1]]

    def plan_at(t: Array) -> Array:
        away: Array = (curve(np.clip(t, start, end)) - planned.q[0]) * weight
        return away

    first, last = measured.t[[0, -1]]
    step = (end - start + 2.0 * (last - first)) / _SHIFTS
    log_grid = np.arange(first, last, step)
    plan_grid = np.arange(start - (last - first), end + (last - first), step)
    p, cost = plan_at(plan_grid), np.zeros(plan_grid.size - log_grid.size + 1)
    for i in range(5):
        q = (np.interp(log_grid, measured.t, measured.q[:, i]) - planned.q[0, i]) * weight[i]
        squares = np.concatenate([[0.0], np.cumsum(p[:, i] ** 2)])
        cost += squares[log_grid.size :] - squares[: -log_grid.size] - 2.0 * correlate(p[:, i], q, mode="valid", method="fft")
    coarse = float(plan_grid[cost.argmin()] - first)
    some = slice(None, None, max(1, measured.t.size // _ALIGNMENT_SAMPLES))
    t, q = measured.t[some], (measured.q[some] - planned.q[0]) * weight

    def error(offset: float) -> float:
        return float(np.sum((q - plan_at(t + offset)) ** 2))

    found = minimize_scalar(error, bounds=(coarse - step, coarse + step), method="bounded", options={"xatol": 1e-9})
    return float(found.x)


def _torque_noise(boom: Boom, plan: Trajectory, covariance: Array, payload_as: PayloadAs) -> Array:
    """Return the standard deviation (5,) of the torques for a given covariance of the motion.

    It is the root mean square over some of the samples of

        var(tau_i) = sum_j D_ij^T covariance_j D_ij,
        D_ij = (dtau_i/dq_j, dtau_i/dqd_j, dtau_i/dqdd_j).
    """
    some = slice(None, None, max(1, plan.t.size // _NOISE_SAMPLES))
    state = [values[some, None, :] for values in (plan.q, plan.qd, plan.qdd)]
    steps = _DIFFERENCE * np.eye(5)

    def tau(moved: int, by: Array) -> Array:
        at = [values + by if i == moved else values for i, values in enumerate(state)]
        return inverse_dynamics(boom, *at, payload_as=payload_as, reactions=False).tau

    D = np.stack([tau(k, steps) - tau(k, -steps) for k in range(3)], axis=-1) / (2.0 * _DIFFERENCE)  # (n, j, i, 3)
    D[..., 1] += np.diag(boom.friction.viscous)
    noise: Array = np.sqrt(np.einsum("njia,jab,njib->ni", D, covariance, D).mean(axis=0))
    return noise


def _extremes(t: Array, values: Array, where: Mask) -> dict[str, float | None]:
    """Return peak, time of the peak, root mean square and mean of values (n,) in a mask.

    All are None if the mask is empty.
    """
    t, values = t[where], values[where]
    if not values.size:
        return dict.fromkeys(("peak", "at_s", "rms", "mean"))
    at = int(np.abs(values).argmax())
    rms, mean = np.sqrt(np.mean(values**2)), values.mean()
    return {"peak": float(values[at]), "at_s": float(t[at]), "rms": float(rms), "mean": float(mean)}
