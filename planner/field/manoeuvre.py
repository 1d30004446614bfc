"""A rig measured from a manoeuvre, in which one point of the vehicle was measured from outside.

The point is the origin of the mount, a point at a known place of the vehicle, or the sensor at the
end of the boom, which moves. `estimate` finds the parameters; here they become figures of the rig.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from scipy.spatial.transform import Rotation

from boom_model import Boom, InputError
from boom_model.arrays import Array
from boom_model.toml_file import editable_toml
from boom_model.words import unknown
from planner.field import attitude
from planner.field.arm import in_mount, up_in_mount, yielding
from planner.field.estimate import ANGLES, JOINTS, LEVER, OFFSET, VEHICLE, Estimate, estimate
from planner.field.geotag import state_at
from planner.field.log_files import JointLog, Points, require_one_clock
from planner.field.rig import Rig
from planner.field.sensor_tags import joints_at
from planner.field.vehicle_log import VehicleLog

PARAMETERS = {
    "delay": VEHICLE,
    "points-delay": OFFSET,
    "joints-delay": JOINTS,
    "lever-arm": LEVER,
    "angles": ANGLES,
}
"""What may be estimated, by the word of the command line."""
MOUNT, SENSOR = "mount", "sensor"
"""Points that have a name; any other is a place on the vehicle."""
_DOUBTFUL = 3.0  # standard deviations between a rig's figure and the one found
_POORLY, _WORST = 2.0, 10.0  # misfit that is pointed out; its root that is refused
_DECIMALS = 6


@dataclass(frozen=True)
class Figure:
    """One figure of the rig, before and after."""

    name: str
    unit: str
    """s, m or rad"""
    before: float
    found: float
    std: float
    """Of `found`."""
    before_std: float
    """Of `before`, as the rig gives it; 0 where it gives none."""

    @property
    def off(self) -> float:
        """How far the two are from each other, in standard deviations of their difference."""
        return abs(self.found - self.before) / float(np.hypot(self.std, self.before_std)) if self.before_std else 0.0


@dataclass(frozen=True, eq=False)
class Measured:
    """Figures of a rig, estimated from a manoeuvre."""

    fit: Estimate
    inflation: float
    """The standard deviations of the fit are multiplied by this: the root of its misfit, at least
    1."""
    figures: tuple[Figure, ...]
    changes: dict[str, dict[str, object]]
    """Keys of the rig's file by table, with their new values."""
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """How many points were used, and how well they fit."""
        return f"{self.fit.used} points used, RMS {self.fit.rms * 1e3:.1f} mm, misfit {self.fit.misfit:.2f} (1: as expected)"

    @property
    def correlation(self) -> str:
        """The two parameters that the manoeuvre tells apart least, or nothing for one."""
        if len(self.fit.names) < 2:
            return ""
        scaled = np.abs(self.fit.covariance / np.outer(self.fit.std, self.fit.std)) - np.eye(len(self.fit.names))
        i, j = np.unravel_index(int(np.argmax(scaled)), scaled.shape)
        return f"largest correlation {scaled[i, j]:.2f}, of {self.fit.names[i]} and {self.fit.names[j]}"

    def to_json(self) -> dict[str, Any]:
        """Return the figures, and the covariance of the parameters in their order, in SI."""
        return {
            "parameters": list(self.fit.names),
            "values": self.fit.values.tolist(),
            "covariance": (self.fit.covariance * self.inflation**2).tolist(),
            "points_used": self.fit.used,
            "rms_m": self.fit.rms,
            "misfit": self.fit.misfit,
            "figures": [asdict(figure) for figure in self.figures],
            "rig": self.changes,
            "warnings": list(self.warnings),
            "notes": list(self.notes),
        }

    @property
    def warnings(self) -> tuple[str, ...]:
        """Figures that are far from the rig's, and points that fit poorly."""
        said = [
            f"{figure.name}: the rig's figure is {figure.off:.0f} standard deviations off"
            for figure in self.figures
            if figure.off > _DOUBTFUL
        ]
        if self.fit.misfit > _POORLY:
            said.append(
                f"the points fit {np.sqrt(self.fit.misfit):.1f} times worse than the standard deviations of both logs say; "
                "those of the figures are multiplied by that"
            )
        return tuple(said)


def measure_rig(
    boom: Boom,
    rig: Rig,
    log: VehicleLog,
    points: Points,
    words: Sequence[str],
    point: str | Array = MOUNT,
    joints: JointLog | None = None,
) -> Measured:
    """Return figures of the rig that fit measured positions of a point best.

    Args:
        boom: the boom.
        rig: the rig as far as it is known; the first guess.
        log: the vehicle's log, of the rig's antenna and inertial sensor.
        points: measured positions.
        words: what to estimate, of PARAMETERS.
        point: what was measured: MOUNT, SENSOR, or a place (3,) on the vehicle [m].
        joints: the joints' log; it is needed for SENSOR.

    Raises:
        InputError: a word is not known, the joints' log is missing, or as `estimate`.
    """
    for word in words:
        if word not in PARAMETERS:
            raise unknown("estimate", word, list(PARAMETERS))
    at_sensor = isinstance(point, str) and point == SENSOR
    if at_sensor and joints is None:
        raise InputError("the measured point is the sensor, so the joints' log is needed")
    free = tuple(name for word in PARAMETERS if word in words for name in PARAMETERS[word])
    if not free:
        raise InputError(f"nothing to estimate; it takes {', '.join(PARAMETERS)}")
    if not at_sensor and {*ANGLES, *JOINTS} & set(free):
        raise InputError("angles and joints-delay need the sensor as the measured point; others do not move in the mount")
    require_one_clock(log, points, *(() if joints is None else (joints,)))
    known = rig.mount if isinstance(point, str) else np.asarray(point, dtype=float)
    body = replace(log, R_ecef_body=log.R_ecef_body @ rig.R_body_imu.T)
    fit = estimate(
        body,
        points.t,
        points.ecef,
        points.std,
        known - rig.antenna,
        free,
        in_mount=_swept(boom, rig, body, joints) if at_sensor and joints is not None else None,
        R_body_mount=rig.R_body_mount,
        latencies=replace(rig.latencies, trigger=0.0),
    )
    if fit.misfit > _WORST**2:
        raise InputError(
            f"{points.source} fits {log.source} {np.sqrt(fit.misfit):.0f} times worse than their standard deviations say, "
            f"{fit.rms:.2g} m (RMS); it must be below {_WORST:g} times: are the clocks seconds apart, or is it another point?"
        )
    inflation = max(1.0, float(np.sqrt(fit.misfit)))
    parts = _parts(rig, fit, inflation, None if isinstance(point, str) else known)
    changes: dict[str, dict[str, object]] = {}
    for table, keys in (item for part in parts for item in part.changes.items()):
        changes.setdefault(table, {}).update(keys)
    notes = [*log.notes, *points.notes, *(() if joints is None else joints.notes)]
    notes += [f"assumed: {each}" for each in rig.assumptions]
    notes.append("the rig's file has no correlations between figures; the covariance is in the JSON")
    notes.append("errors are taken as independent from one point to the next; slow ones of GNSS make the deviations too small")
    if LEVER[0] in free:
        notes.append("the lever arm from antenna to mount is what was measured; geotags still count std_m of both ends")
    if at_sensor:
        notes.append("backlash and hysteresis of the boom are the same all through a manoeuvre: the deviations leave them out")
    return Measured(
        fit, inflation, tuple(figure for part in parts for figure in part.figures), changes, tuple(dict.fromkeys(notes))
    )


def write_measured(path: str | Path, rig_file: str | Path, measured: Measured, source: str) -> None:
    """Write the rig's file with the figures that were found; its comments stay.

    A table whose position or angles were found is `measured`. One with a new latency alone keeps
    its basis, and its source says where the latency is from.

    Args:
        path: the file to write.
        rig_file: the rig's file.
        measured: the figures.
        source: where they are from.

    Raises:
        InputError: the rig's file cannot be read.
    """
    document: dict[str, Any] = editable_toml(Path(rig_file))
    for part, keys in measured.changes.items():
        table = document[part]
        table.update(keys)
        if "std_m" in keys or "std_deg" in keys:
            table.update({"basis": "measured", "source": source})
        else:
            table["source"] = f"{table['source']}; latency measured: {source}"
    Path(path).write_text(tomlkit.dumps(document), encoding="utf-8")


def _swept(boom: Boom, rig: Rig, body: VehicleLog, joints: JointLog) -> Callable[[Array], Array]:
    """Return the sensor in frame 1 at true times, wind-up taken off; NaN where it is not known."""

    def at(times: Array) -> Array:
        state = state_at(body, times, replace(rig.latencies, trigger=0.0))
        q, _, reasons = joints_at(joints, times + rig.latencies.joints)
        known = state.known & np.array([not reason for reason in reasons], dtype=bool)
        found = np.full((len(times), 3), np.nan)
        if known.any():
            up = up_in_mount(rig, state.ecef[known], state.R_ecef_body[known])
            found[known] = in_mount(boom, yielding(boom, q[known], up), rig.sensor)
        return found

    return at


@dataclass(frozen=True, eq=False)
class _Part:
    """Figures of one table of the rig's file."""

    figures: tuple[Figure, ...]
    changes: dict[str, dict[str, object]]


def _times(rig: Rig, value: dict[str, float], std: dict[str, float]) -> Iterator[_Part]:
    late = rig.latencies
    for (name,), label, before, before_std, tables in (
        (
            VEHICLE,
            "latency of the vehicle's log",
            late.position,
            late.position_std,
            {"antenna": late.position, "imu": late.attitude},
        ),
        (JOINTS, "latency of the joints' log", late.joints, late.joints_std, {"joints": late.joints}),
        (OFFSET, "latency of the points", 0.0, 0.0, {}),
    ):
        if name in value:
            figure = Figure(label, "s", before, before + value[name], std[name], before_std)
            deviation = round(std[name], _DECIMALS)
            keys: dict[str, dict[str, object]] = {
                table: {"latency_s": round(old + value[name], _DECIMALS), "latency_std_s": deviation}
                for table, old in tables.items()
            }
            yield _Part((figure,), keys)


def _lever(rig: Rig, r: Array, std: Array, place: Array | None) -> _Part:
    """Where the mount is from the antenna, or the antenna from a point at a known place."""
    table, old, old_std, new = (
        ("mount", rig.mount, rig.mount_std, rig.antenna + r)
        if place is None
        else ("antenna", rig.antenna, rig.antenna_std, place - r)
    )
    rows = zip("xyz", old.tolist(), new.tolist(), std.tolist(), strict=True)
    figures = tuple(Figure(f"{table} {axis}", "m", a, b, deviation, old_std) for axis, a, b, deviation in rows)
    place_m = [round(each, _DECIMALS) for each in new.tolist()]
    return _Part(figures, {table: {"position_m": place_m, "std_m": round(float(std.max()), _DECIMALS)}})


def _turn(rig: Rig, turn: Array, std: Array) -> _Part:
    rows = zip("xyz", turn.tolist(), std.tolist(), strict=True)
    figures = tuple(Figure(f"mount turned about {axis}", "rad", 0.0, a, s, rig.mount_turn_std) for axis, a, s in rows)
    R_body_mount = Rotation.from_rotvec(turn).as_matrix() @ rig.R_body_mount
    angles = np.degrees(attitude.angles(attitude.rotation(0.0, 0.0, 0.0) @ R_body_mount))
    keys: dict[str, object] = {
        f"{name}_deg": round((angle + 180.0) % 360.0 - 180.0, _DECIMALS)
        for name, angle in zip(attitude.NAMES, angles.tolist(), strict=True)
    }
    return _Part(figures, {"mount": keys | {"std_deg": round(float(np.degrees(std.max())), _DECIMALS)}})


def _parts(rig: Rig, fit: Estimate, inflation: float, place: Array | None) -> list[_Part]:
    """Return what was found; `place` is the point on the vehicle, None at mount or boom."""
    value = dict(zip(fit.names, fit.values.tolist(), strict=True))
    std = dict(zip(fit.names, (fit.std * inflation).tolist(), strict=True))

    def of(names: tuple[str, ...], given: dict[str, float]) -> Array:
        return np.array([given[name] for name in names])

    parts = list(_times(rig, value, std))
    if LEVER[0] in value:
        parts.append(_lever(rig, of(LEVER, value), of(LEVER, std), place))
    if ANGLES[0] in value:
        parts.append(_turn(rig, of(ANGLES, value), of(ANGLES, std)))
    return parts
