"""Time offset, lever arm and mounting angles from a manoeuvre, by nonlinear least squares.

A point of the vehicle was measured from outside, or by a second receiver, at time stamps t_k:

    z_k = p_antenna(t + v) + R_enu_body(t + v) (r + R(a) m(t + j)) + noise,   t = t_k - d

d is how late the stamps of the points are, v those of the vehicle's log, j those of the joints'
log, r the lever arm from the antenna (to the mount, where the point moves on a mount), a the
mounting angles, and m the point in the mount. What the manoeuvre does not tell apart is refused: a
straight drive does not tell the lever arm along it from the time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from boom_model import InputError
from boom_model.arrays import Array, checked
from planner.field.earth import LocalFrame
from planner.field.geotag import Latencies, state_at
from planner.field.vehicle_log import VehicleLog

OFFSET = ("offset_s",)
VEHICLE = ("vehicle_latency_s",)
JOINTS = ("joints_latency_s",)
LEVER = ("lever_x_m", "lever_y_m", "lever_z_m")
ANGLES = ("angle_x_rad", "angle_y_rad", "angle_z_rad")
_TIMES = (*OFFSET, *VEHICLE, *JOINTS)
_STEPS = dict.fromkeys(_TIMES, 0.25) | dict.fromkeys(LEVER, 0.05) | dict.fromkeys(ANGLES, 0.01)
"""Of the differences that give the slopes."""
_WORST = dict.fromkeys(_TIMES, 0.03) | {"lever": 0.5, "angle": 0.2}
"""Standard deviations from which a manoeuvre tells nothing of a parameter."""
_MOST_OFFSET = 2.0  # [s]
_SMOOTH = 1.0  # [s]
_NOISE = 3.0  # times the information that noise pretends
_ITERATIONS, _CLOSE, _SINGULAR = 20, 1e-6, 1e12
_FEWEST = 10


@dataclass(frozen=True, eq=False)
class Estimate:
    """What fits a manoeuvre best."""

    names: tuple[str, ...]
    values: Array
    """(k,) of each parameter, with its unit in its name; lever arms are whole, times and angles are
    added to the rig's"""
    covariance: Array
    """(k, k)"""
    rms: float
    """Root mean square of the residuals [m]."""
    misfit: float
    """Chi-square of the residuals over their degrees of freedom: 1 where the standard deviations
    are true."""
    used: int
    """Number of measured points used."""

    @property
    def std(self) -> Array:
        """(k,) standard deviation of each parameter."""
        deviations: Array = np.sqrt(np.diag(self.covariance))
        return deviations

    def __getitem__(self, name: str) -> float:
        """Return a parameter by its name."""
        return float(self.values[self.names.index(name)])


def estimate(
    log: VehicleLog,
    times: ArrayLike,
    observed: ArrayLike,
    std: ArrayLike,
    lever: ArrayLike,
    free: Sequence[str] = (*OFFSET, *LEVER),
    *,
    in_mount: Callable[[Array], Array] | None = None,
    R_body_mount: ArrayLike | None = None,
    latencies: Latencies | None = None,
) -> Estimate:
    """Return the parameters that fit measured positions of a point best, with their covariance.

    Args:
        log: the vehicle's log.
        times: (n,) time stamps of the measured positions [s].
        observed: (n, 3) positions of the point in ECEF [m].
        std: standard deviation of each coordinate, one number or (n,) [m]; the log's own is added.
        lever: (3,) first guess of the lever arm from the antenna [m].
        free: parameters to estimate, of OFFSET, VEHICLE, JOINTS, LEVER and ANGLES.
        in_mount: the point in the mount (m, 3) [m] at times (m,), which JOINTS moves; NaN where it
            is not known. None is the mount's origin.
        R_body_mount: (3, 3) mounting as the rig gives it; None is the vehicle's axes.
        latencies: of the log, taken off.

    Raises:
        InputError: too few points lie within the log, a time is off by more than 2 s, or the
            manoeuvre does not tell a parameter.
    """
    stamps, seen, start = checked("times", times), checked("observed", observed, 3), checked("lever", lever, 3)
    if in_mount is None and set(free) & {*ANGLES, *JOINTS}:
        raise InputError(
            "mounting angles need a point that moves in the mount, and so does the joints' latency; "
            "a fixed one gives its lever arm alone"
        )
    if {*OFFSET, *VEHICLE} <= set(free):
        raise InputError("one manoeuvre does not tell the latency of the vehicle's log from that of the measured points")
    late = Latencies() if latencies is None else latencies
    inside = (stamps - _MOST_OFFSET > log.t[0]) & (stamps + _MOST_OFFSET < log.t[-1])
    deviations = np.broadcast_to(checked("std", std), stamps.shape)
    if len(stamps):
        known = state_at(log, stamps, late).known
        if in_mount is not None:
            known &= np.isfinite(in_mount(stamps)).all(axis=-1)
        inside &= known
    stamps, seen, deviations = stamps[inside], seen[inside], deviations[inside]
    if len(stamps) < max(_FEWEST, len(free)):
        raise InputError(
            f"{len(stamps)} measured positions lie within {log.source} less {_MOST_OFFSET:g} s at its ends; it needs {_FEWEST}"
        )
    frame = LocalFrame.at(*(float(each[0]) for each in log.geodetic))
    names, mounted = tuple(free), np.eye(3) if R_body_mount is None else np.asarray(R_body_mount, dtype=float)
    base = np.array([start[LEVER.index(name)] if name in LEVER else 0.0 for name in names])
    variance = state_at(log, stamps, late).position_covariance.diagonal(axis1=1, axis2=2).mean(axis=1)
    weight = 1.0 / np.sqrt(deviations**2 + variance)

    smooth = _smoothed(log)

    def residuals(values: Array, of: VehicleLog = log) -> Array:
        value = dict(zip(names, values, strict=True))
        points, vehicle, joints = (float(np.clip(value.get(name, 0.0), -_MOST_OFFSET, _MOST_OFFSET)) for name in _TIMES)
        later = replace(late, position=late.position + vehicle, attitude=late.attitude + vehicle)
        state = state_at(of, stamps - points, later)
        r = np.array([value.get(name, start[i]) for i, name in enumerate(LEVER)])
        arm = np.broadcast_to(r, (len(stamps), 3))
        if in_mount is not None:
            turn = Rotation.from_rotvec([value.get(name, 0.0) for name in ANGLES]).as_matrix() @ mounted
            arm = arm + in_mount(state.t + joints) @ turn.T
        predicted = state.ecef + np.einsum("nij,nj->ni", state.R_ecef_body, arm)
        off: Array = np.nan_to_num(frame.enu(predicted) - frame.enu(seen)) * weight[:, None]
        return off.ravel()

    def slopes(values: Array) -> Array:
        steps = np.diag([_STEPS[name] for name in names])
        columns = [(residuals(values + h, smooth) - residuals(values - h, smooth)) / (2.0 * h.sum()) for h in steps]
        return np.stack(columns, axis=-1)

    values = base.copy()
    for _ in range(_ITERATIONS):  # Gauss and Newton's; the slopes are those of the smoothed log
        J, off = slopes(values), residuals(values)
        step = np.linalg.lstsq(J, -off, rcond=None)[0]
        values = values + step
        if (np.abs(step) < _CLOSE).all():
            break
    for name in set(names) & set(_TIMES):
        if abs(values[names.index(name)]) >= _MOST_OFFSET:
            raise InputError(f"{name} is beyond {_MOST_OFFSET:g} s; set the clocks nearer before it is estimated")
    J, off = slopes(values), residuals(values)
    scales = np.array([_STEPS[name] for name in names])
    normal = (J * scales).T @ (J * scales)
    if np.linalg.cond(normal) > _SINGULAR:
        raise InputError(f"the manoeuvre does not tell {', '.join(names)} apart; it must turn, and change its speed")
    covariance = np.linalg.inv(normal) * np.outer(scales, scales)
    clocks = [names.index(name) for name in (*OFFSET, *VEHICLE) if name in names]
    if clocks and len(names) > 1 and 1.0 / covariance[clocks[0], clocks[0]] < _NOISE * _made_up(log, weight, variance):
        raise InputError("the manoeuvre does not tell the time from the lever arm; it must turn, and change its speed")
    for name, deviation in zip(names, np.sqrt(np.diag(covariance)), strict=True):
        worst = next(bound for kind, bound in _WORST.items() if name.startswith(kind))
        if deviation > worst:
            raise InputError(f"the manoeuvre gives {name} to +-{deviation:.2g} alone; it must turn, and change its speed")
    freedom = max(off.size - len(names), 1)
    rms = float(np.sqrt((off.reshape(-1, 3) ** 2 / weight[:, None] ** 2).sum(axis=1).mean()))
    return Estimate(names, values, covariance, rms, float((off**2).sum() / freedom), len(stamps))


def _made_up(log: VehicleLog, weight: Array, variance: Array) -> float:
    """Return the information on the time [1/s^2] that noise of the smoothed velocity pretends.

    It is 12 s^2 / (n^3 dt^2) for each coordinate.
    """
    dt = float(np.median(np.diff(log.t)))
    count = max(_SMOOTH / dt, 2.0)
    return float((weight**2 * 3.0 * 12.0 * variance / (count**3 * dt**2)).sum())


def _smoothed(log: VehicleLog) -> VehicleLog:
    """Return the log smoothed by parabolas over a second, for slopes without made-up noise."""
    count = int(_SMOOTH / float(np.median(np.diff(log.t)))) // 2 * 2 + 1
    if count < 5 or count > len(log.t):
        return log
    return replace(log, ecef=savgol_filter(log.ecef, count, 2, axis=0, mode="interp"), velocity=None)
