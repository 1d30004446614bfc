"""Where a sensor at the end of the boom was, and the spot of ground or canopy that it saw.

The spot is where the view meets the canopy, a level plane above the ground under the mount. Its
covariance is that of the rigid point at that range along the view, moved along the view back into
the plane, and the height of the plane itself.
"""

from dataclasses import dataclass, replace

import numpy as np

from boom_model import Boom, InputError, forward_kinematics
from boom_model.arrays import Array, Mask, read_only
from planner.field.arm import lever_arm, play, up_in_mount, yielding
from planner.field.earth import axes, geodetic_of
from planner.field.geotag import Geotags, State, clock_doubts, state_at, tag
from planner.field.intervals import intervals
from planner.field.log_files import JointLog, Triggers, require_one_clock
from planner.field.rig import Rig
from planner.field.vehicle_log import VehicleLog

_STEEPEST = 0.1  # sine of the elevation below which a view meets no canopy near by
_GAPS = 3.0
_SHORTEST_GAP = 0.02  # [s]
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


@dataclass(frozen=True, eq=False)
class SensorTags:
    """Geotags of a sensor; NaN where a trigger has none."""

    triggers: Triggers
    sensor: Geotags
    seen: Geotags
    """Of the middle of what it saw; its covariance holds the height of the canopy, too."""
    view: Array
    """(n, 3) unit vector of the view, east, north, up"""
    footprint: Array
    """(n, 4, 3) corners of what it saw, in ECEF [m]"""
    q: Array
    """(n, 5) joint positions, wind-up taken off [rad, m]"""
    sag: Array
    """(n, 3) what the wind-up moved the sensor by, east, north, up [m]"""
    notes: tuple[str, ...]
    """What is assumed, left out or doubtful."""
    warnings: tuple[str, ...]
    """Gaps, jumps and clocks that do not go together."""

    @property
    def known(self) -> Mask:
        """(n,) where there is a tag."""
        return self.sensor.known

    @property
    def lost(self) -> tuple[str, ...]:
        """Triggers without a tag, and why."""
        return tuple(f"{self.triggers.labels[k]}: {self.sensor.reasons[k]}" for k in np.flatnonzero(~self.known))

    @property
    def bearing(self) -> Array:
        """(n,) direction of the view, clockwise from north [rad]; straight down it means little."""
        return np.asarray(np.arctan2(self.view[:, 0], self.view[:, 1]) % (2.0 * np.pi))


def tag_sensor(boom: Boom, rig: Rig, log: VehicleLog, joints: JointLog, triggers: Triggers) -> SensorTags:
    """Return where a sensor was at every trigger, and what it saw.

    Args:
        boom: the boom; its gearboxes' wind-up under gravity is taken off the measured joints.
        rig: positions on the vehicle, mounting angles and latencies.
        log: the vehicle's log, of the rig's antenna and inertial sensor.
        joints: the joints' log.
        triggers: when the sensor measured.

    Raises:
        InputError: the logs have different clocks, or no trigger lies within both.
    """
    require_one_clock(log, joints, triggers)
    if not len(triggers.t):
        raise InputError(f"{triggers.source}: no trigger")
    late = rig.latencies
    state = _turned(state_at(log, triggers.t, late), rig.R_body_imu)
    q, qd, reasons = joints_at(joints, state.t + late.joints)
    reasons = tuple(first or second for first, second in zip(state.reasons, reasons, strict=True))
    known = np.array([not reason for reason in reasons], dtype=bool)
    if not known.any():
        doubts = clock_doubts(triggers.source, triggers.t, log.source, log.t)
        raise InputError(f"{triggers.source}: no trigger has a position: the first is {reasons[0]}{'; ' if doubts else ''}"
                         f"{'; '.join(doubts)}")  # fmt: skip
    part = _known(state, known)
    to_enu = _to_enu(part)
    R = to_enu @ part.R_ecef_body
    measured = q[known]
    bent = yielding(boom, measured, up_in_mount(rig, part.ecef, part.R_ecef_body))
    view_mount = np.einsum("nij,j->ni", forward_kinematics(boom, bent).rotation, rig.view)
    view = np.einsum("nij,nj->ni", R @ rig.R_body_mount, view_mount)
    sensor = tag(part, lever_arm(boom, rig, bent, qd[known], rig.sensor), triggers.t[known], late)
    straight = lever_arm(boom, rig, measured, qd[known], rig.sensor)
    sag = np.einsum("nij,nj->ni", R, lever_arm(boom, rig, bent, qd[known], rig.sensor).r - straight.r)
    depth = _depth(rig, part, R, to_enu, sensor)
    steep = view[:, 2] < -_STEEPEST
    reach = np.where(steep, depth / np.minimum(view[:, 2], -_STEEPEST), np.nan)
    spot = lever_arm(boom, rig, bent, qd[known], rig.sensor + np.nan_to_num(reach)[:, None] * rig.view)
    seen = _in_plane(tag(part, spot, triggers.t[known], late), view, rig.ground_std, steep & (reach > 0.0))
    corners = _corners(rig, bent, boom, R, to_enu, sensor, depth)
    corners[~(steep & (reach > 0.0))] = np.nan
    blind = int((~(steep & (reach > 0.0))).sum())
    notes = [*log.notes, *joints.notes, *triggers.notes, *(f"assumed: {each}" for each in rig.assumptions), *play(boom)[1]]
    notes.append("links bend, and the mast of the antenna: not counted")
    if blind:
        notes.append(f"{blind} views do not meet the canopy (level, upwards, or below it): no spot")
    n = len(triggers.t)
    return SensorTags(
        triggers=triggers,
        sensor=_spread(sensor, known, reasons, triggers.t),
        seen=_spread(seen, known, reasons, triggers.t),
        view=_filled(view, known, n),
        footprint=_filled(corners, known, n),
        q=_filled(bent, known, n),
        sag=_filled(sag, known, n),
        notes=tuple(dict.fromkeys(notes)),
        warnings=(
            *log.warnings,
            *clock_doubts(triggers.source, triggers.t, log.source, log.t),
            *clock_doubts(joints.source, joints.t, log.source, log.t),
        ),
    )


def joints_at(log: JointLog, stamps: Array) -> tuple[Array, Array, tuple[str, ...]]:
    """Return joint positions and rates (n, 5) at time stamps (n,), and why one has none."""
    dt = np.diff(log.t)
    gaps = np.where(dt > max(_GAPS * float(np.median(dt)), _SHORTEST_GAP), dt, 0.0)
    k, share, reasons = intervals(log.t, stamps, log.source, log.lines, (("gap", gaps, "s"),))
    step = log.q[k + 1] - log.q[k]
    return log.q[k] + share[:, None] * step, step / dt[k][:, None], reasons


def _depth(rig: Rig, state: State, R: Array, to_enu: Array, sensor: Geotags) -> Array:
    """Return how far (n,) the canopy is above the sensor [m]; negative below."""
    ground = np.array([rig.mount[0], rig.mount[1], rig.ground]) - rig.antenna
    antenna_to_sensor = np.einsum("nij,nj->ni", to_enu, sensor.ecef - state.ecef)[:, 2]
    below: Array = (R @ ground)[:, 2] + rig.canopy - antenna_to_sensor
    return below


def _corners(rig: Rig, q: Array, boom: Boom, R: Array, to_enu: Array, sensor: Geotags, depth: Array) -> Array:
    """Return the corners (n, 4, 3) of the footprint in ECEF, where its rays meet the canopy."""
    turn = R @ rig.R_body_mount @ forward_kinematics(boom, q).rotation
    across = np.cross(rig.view, [0.0, 1.0, 0.0]) if abs(rig.view[1]) < 0.9 else np.cross(rig.view, [1.0, 0.0, 0.0])
    across = across / np.linalg.norm(across)
    along = np.cross(across, rig.view)
    sides = _CORNERS * rig.spread
    rays = rig.view + sides[:, :1] * along + sides[:, 1:] * across
    enu = np.einsum("nij,kj->nki", turn, rays)
    slope = np.minimum(enu[..., 2], -_STEEPEST)
    reached = enu * (depth[:, None] / slope)[..., None]
    corners: Array = sensor.ecef[:, None, :] + np.einsum("nji,nkj->nki", to_enu, reached)
    return corners


def _in_plane(spot: Geotags, view: Array, height_std: float, steep: Mask) -> Geotags:
    """Return the spot, its covariance moved along the view into the plane; NaN without a spot."""
    down = np.minimum(view[:, 2], -_STEEPEST)
    along = view / down[:, None]
    flat = np.eye(3) - along[:, :, None] * np.array([0.0, 0.0, 1.0])
    covariance = flat @ spot.covariance @ np.swapaxes(flat, -1, -2)
    covariance += height_std**2 * along[:, :, None] * along[:, None, :]
    none = ~steep
    ecef = spot.ecef.copy()
    ecef[none], covariance[none] = np.nan, np.nan
    return replace(spot, ecef=ecef, covariance=covariance)


def _turned(state: State, R_body_imu: Array) -> State:
    """Return the state of the vehicle, given that of the inertial sensor."""
    return replace(state, R_ecef_body=state.R_ecef_body @ R_body_imu.T)


def _to_enu(state: State) -> Array:
    latitude, longitude, _ = geodetic_of(state.ecef)
    return np.swapaxes(axes(latitude, longitude), -1, -2)


def _known(state: State, known: Mask) -> State:
    arrays = ("t", "ecef", "velocity", "R_ecef_body", "turning", "position_covariance", "attitude_covariance")
    return State(**{name: getattr(state, name)[known] for name in arrays}, reasons=("",) * int(known.sum()))


def _spread(tags: Geotags, known: Mask, reasons: tuple[str, ...], t: Array) -> Geotags:
    arrays = ("ecef", "covariance", "velocity", "R_enu_body")
    return Geotags(t, **{name: _filled(getattr(tags, name), known, len(t)) for name in arrays}, reasons=reasons)


def _filled(values: Array, known: Mask, n: int) -> Array:
    whole = np.full((n, *values.shape[1:]), np.nan)
    whole[known] = values
    return read_only(whole)
