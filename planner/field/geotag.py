"""Where points of a rigid body were, from the log of one of them, with first-order covariance.

    p = p_antenna + R_enu_body r,   r = r_point - r_antenna

everything at the time of the trigger. To first order, its covariance is the sum of those of

    the antenna's position    P
    the attitude              A S A^T,   A's columns: axis_i x R r
    the lever arm             R C R^T
    the clocks                s^2 v v^T, v what the point does in a second of each clock

The boom is not needed here: `planner.field.arm` gives the lever arms of its sensors.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from boom_model import InputError
from boom_model.arrays import Array, Mask, checked, read_only
from planner.field import attitude
from planner.field.earth import axes, geodetic_of
from planner.field.intervals import intervals
from planner.field.vehicle_log import VehicleLog

CHI_SQUARE_95 = 5.991464547107979
"""95 % of a chi-square distribution of two degrees of freedom."""
_HALF_MINUTE = 30.0
_LEAP = 18.0  # [s] GPS time ahead of UTC since 2017


@dataclass(frozen=True)
class Latencies:
    """How late [s] each time stamp is: what is stamped t was so at t - latency.

    Each with its standard deviation.
    """

    position: float = 0.0
    """Of the vehicle's position."""
    attitude: float = 0.0
    """Of the vehicle's attitude."""
    joints: float = 0.0
    """Of the joint log."""
    trigger: float = 0.0
    """Of the sensor's triggers."""
    position_std: float = 0.0
    attitude_std: float = 0.0
    joints_std: float = 0.0
    trigger_std: float = 0.0


@dataclass(frozen=True, eq=False)
class LeverArm:
    """From the antenna to a point, along the vehicle's axes (x forward, y left, z up)."""

    r: Array
    """(3,) or (n, 3) at each trigger [m]"""
    covariance: Array
    """(3, 3) or (n, 3, 3) [m^2]"""
    rate: Array
    """(3,) or (n, 3) its velocity on the vehicle [m/s]"""

    @staticmethod
    def of(r: ArrayLike, covariance: ArrayLike = 0.0, rate: ArrayLike = (0.0, 0.0, 0.0)) -> "LeverArm":
        """Return a lever arm from arrays; a number as covariance is that times the unit matrix.

        Raises:
            InputError: an array is not finite or has the wrong shape.
        """
        given = checked("covariance of a lever arm", covariance)
        if given.shape == ():
            given = given * np.eye(3)
        if given.shape[-2:] != (3, 3):
            raise InputError(f"covariance of a lever arm has shape {given.shape}; it must be (..., 3, 3)")
        return LeverArm(read_only(checked("lever arm", r, 3)), read_only(given), read_only(checked("rate", rate, 3)))


@dataclass(frozen=True, eq=False)
class State:
    """The vehicle at some times, interpolated between its fixes; NaN where it is not known."""

    t: Array
    """(n,) the true times [s]"""
    ecef: Array
    """(n, 3) of the antenna [m]"""
    velocity: Array
    """(n, 3) of the antenna in ECEF [m/s]"""
    R_ecef_body: Array
    """(n, 3, 3)"""
    turning: Array
    """(n, 3) angular velocity in ECEF [rad/s]"""
    position_covariance: Array
    """(n, 3, 3) east, north, up [m^2]"""
    attitude_covariance: Array
    """(n, 3, 3) roll, pitch, heading [rad^2]"""
    reasons: tuple[str, ...]
    """Why a time has no state; "" where it has."""

    @property
    def known(self) -> Mask:
        """(n,) where there is a state."""
        return np.array([not reason for reason in self.reasons], dtype=bool)


@dataclass(frozen=True, eq=False)
class Geotags:
    """Position of one point at every trigger; NaN where it is not known."""

    t: Array
    """(n,) time stamps of the triggers, as given [s]"""
    ecef: Array
    """(n, 3) [m]"""
    covariance: Array
    """(n, 3, 3) east, north, up [m^2]"""
    velocity: Array
    """(n, 3) east, north, up [m/s]"""
    R_enu_body: Array
    """(n, 3, 3) attitude of the vehicle"""
    reasons: tuple[str, ...]
    """Why a trigger has no position; "" where it has."""

    @property
    def known(self) -> Mask:
        """(n,) where there is a position."""
        return np.array([not reason for reason in self.reasons], dtype=bool)

    @property
    def geodetic(self) -> tuple[Array, Array, Array]:
        """Latitude, longitude [rad], height [m], each (n,); NaN where not known."""
        found = np.full((3, len(self.t)), np.nan)
        if self.known.any():
            found[:, self.known] = geodetic_of(self.ecef[self.known])
        return found[0], found[1], found[2]

    @property
    def ellipses(self) -> Array:
        """(n, 3) horizontal 95 % ellipses: half axes [m], the long one's angle from north [rad]."""
        return ellipses(self.covariance[:, :2, :2])


def ellipses(covariance: Array) -> Array:
    """Return the 95 % ellipse (n, 3) of covariances (n, 2, 2) [m^2] in east and north.

    It is the long and the short half axis [m], and the angle of the long one clockwise from north
    [rad], in [0, pi).
    """
    found = np.full((len(covariance), 3), np.nan)
    known = np.isfinite(covariance).all(axis=(-2, -1))
    values, vectors = np.linalg.eigh(covariance[known])
    found[known, 0] = np.sqrt(CHI_SQUARE_95 * np.maximum(values[:, 1], 0.0))
    found[known, 1] = np.sqrt(CHI_SQUARE_95 * np.maximum(values[:, 0], 0.0))
    found[known, 2] = np.arctan2(vectors[:, 0, 1], vectors[:, 1, 1]) % np.pi
    return found


def geotag(
    vehicle_log: VehicleLog,
    lever_arms: Mapping[str, LeverArm | ArrayLike],
    times: ArrayLike,
    latencies: Latencies | None = None,
) -> dict[str, Geotags]:
    """Return where each point of the vehicle was at each time.

    A time in a gap, beside a jump or outside the log has no position, and its reason is given.

    Args:
        vehicle_log: the log of the vehicle.
        lever_arms: from the antenna to each point: (3,), (n, 3) [m] or a `LeverArm`.
        times: (n,) time stamps of the triggers, on the log's clock [s].
        latencies: of the time stamps; None is none.

    Raises:
        InputError: times or lever arms are not finite, or of another shape.
    """
    times = checked("times", times)
    if times.ndim != 1:
        raise InputError(f"times has shape {times.shape}; it must be (n,)")
    late = Latencies() if latencies is None else latencies
    state = state_at(vehicle_log, times, late)
    return {name: tag(state, _lever(name, arm, len(times)), times, late) for name, arm in lever_arms.items()}


def _lever(name: str, arm: LeverArm | ArrayLike, n: int) -> LeverArm:
    lever = arm if isinstance(arm, LeverArm) else LeverArm.of(arm)
    if lever.r.ndim > 2 or (lever.r.ndim == 2 and len(lever.r) != n):
        raise InputError(f"lever arm {name} has shape {lever.r.shape}; it must be (3,) or ({n}, 3)")
    return lever


def tag(state: State, lever: LeverArm, times: Array, latencies: Latencies) -> Geotags:
    """Return where a point was, given the vehicle's state; see `geotag`."""
    n, known = len(state.t), state.known
    ecef, covariance = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan)
    velocity, R_enu_body = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan)
    r, C, rate = (
        np.broadcast_to(part, (n, *part.shape[-k:]))[known]
        for part, k in ((lever.r, 1), (lever.covariance, 2), (lever.rate, 1))
    )
    if known.any():
        R_ecef_body = state.R_ecef_body[known]
        arm = np.einsum("nij,nj->ni", R_ecef_body, r)
        ecef[known] = state.ecef[known] + arm
        latitude, longitude, _ = geodetic_of(state.ecef[known])
        to_enu = np.swapaxes(axes(latitude, longitude), -1, -2)
        R = to_enu @ R_ecef_body
        turned = np.einsum("nij,nj->ni", R, r)
        swing = np.cross(np.swapaxes(attitude.error_axes(R), -1, -2), turned[:, None, :])  # row i: axis_i x R r
        A = np.swapaxes(swing, -1, -2)
        moving = np.einsum("nij,nj->ni", to_enu, state.velocity[known])
        turning = np.einsum("nij,nj->ni", to_enu, np.cross(state.turning[known], arm))
        working = np.einsum("nij,nj->ni", R, rate)
        whole = moving + turning + working
        total = state.position_covariance[known] + A @ state.attitude_covariance[known] @ np.swapaxes(A, -1, -2)
        total += R @ C @ np.swapaxes(R, -1, -2)
        for v, std in (
            (moving, latencies.position_std),
            (turning, latencies.attitude_std),
            (working, latencies.joints_std),
            (whole, latencies.trigger_std),
        ):
            total += std**2 * v[:, :, None] * v[:, None, :]
        covariance[known], velocity[known], R_enu_body[known] = total, whole, R
    return Geotags(times, ecef, covariance, velocity, R_enu_body, state.reasons)


def state_at(log: VehicleLog, times: Array, latencies: Latencies) -> State:
    """Return the vehicle's state at time stamps (n,) of triggers [s].

    Position is a cubic with the velocities of the fixes where the log has them, and a line
    otherwise. Attitude turns evenly about one axis from fix to fix, so all is independent of the
    axes' singularities. The errors of neighbouring fixes are taken as the same, which is the safe
    side.
    """
    true = times - latencies.trigger
    k, u, reasons = _intervals(log, true + latencies.position)
    m, w, others = _intervals(log, true + latencies.attitude)
    reasons = tuple(first or second for first, second in zip(reasons, others, strict=True))
    dt = np.diff(log.t)
    h = dt[k][:, None]
    p0, p1, s = log.ecef[k], log.ecef[k + 1], u[:, None]
    if log.velocity is None:
        ecef, velocity = p0 + s * (p1 - p0), (p1 - p0) / h
    else:
        v0, v1 = log.velocity[k], log.velocity[k + 1]
        step = p1 - p0
        ecef = p0 + s * h * v0 + s**2 * (3.0 * step - h * (2.0 * v0 + v1)) + s**3 * (h * (v0 + v1) - 2.0 * step)
        velocity = v0 + 2.0 * s * (3.0 * step / h - 2.0 * v0 - v1) + 3.0 * s**2 * (v0 + v1 - 2.0 * step / h)
    R0 = Rotation.from_matrix(log.R_ecef_body[m])
    turn = (R0.inv() * Rotation.from_matrix(log.R_ecef_body[m + 1])).as_rotvec()
    R = R0 * Rotation.from_rotvec(turn * w[:, None])
    known = np.array([not reason for reason in reasons], dtype=bool)

    def mixed(values: Array, k: "NDArray[np.int_]", u: Array) -> Array:
        share = u.reshape(-1, *(1,) * (values.ndim - 1))
        return _where(known, (1.0 - share) * values[k] + share * values[k + 1])

    return State(
        t=true,
        ecef=_where(known, ecef),
        velocity=_where(known, velocity),
        R_ecef_body=_where(known, R.as_matrix()),
        turning=_where(known, R.apply(turn / dt[m][:, None])),
        position_covariance=mixed(log.position_covariance, k, u),
        attitude_covariance=mixed(log.attitude_covariance, m, w),
        reasons=reasons,
    )


def clock_doubts(source: str, times: Array, log_source: str, log_times: Array) -> tuple[str, ...]:
    """Return what is odd between two logs' times: offsets of half hours, or of GPS time's 18 s."""
    if not len(times) or not len(log_times):
        return ()
    ends = times[0] - log_times[0], times[-1] - log_times[-1]
    said = []
    for offset in ends:
        halves = round(offset / 1800.0)
        apart = times[0] > log_times[-1] or times[-1] < log_times[0]
        if apart and halves and abs(offset - 1800.0 * halves) < _HALF_MINUTE:
            said.append(
                f"{source} is {offset / 3600.0:+.1f} h from {log_source}: one of them may be in local time; "
                "write its offset, as in 2026-07-01T09:00:00-06:00"
            )
        elif all(abs(abs(each) - _LEAP) < 1.0 for each in ends):
            said.append(
                f"{source} is {offset:+.1f} s from {log_source} at both ends: one of them may be GPS time, written as UTC"
            )
    return tuple(dict.fromkeys(said))


def _where(known: Mask, values: Array) -> Array:
    return np.where(known.reshape(-1, *(1,) * (values.ndim - 1)), values, np.nan)


def _intervals(log: VehicleLog, stamps: Array) -> "tuple[NDArray[np.int_], Array, tuple[str, ...]]":
    flaws = (("gap", np.where(log.gaps, np.diff(log.t), 0.0), "s"), ("jump", log.jumps, "m"))
    return intervals(log.t, stamps, log.source, log.lines, flaws)
