"""Tip position as a function of a calibration's parameters, with the exact derivative.

    x = R p(q) + t,    q_i = scale_i reading_i + offset_i - c_i w_i(tau_i)

p is the forward kinematics, the general four-bar included, moved to the target. w_i is the printed
wind-up of a gearbox under the static torque of the pose and c_i its measured share. R and t place
the boom in the measuring frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from boom_model import Boom, Geometry, InputError, forward_kinematics, wind_up
from boom_model.arrays import Array, read_only
from boom_model.boom import IS_LENGTH
from boom_model.calibration import INNER, LENGTHS, OFFSETS, SCALE, UPPER, WIND_UPS
from boom_model.tip_uncertainty import tip_by_joints, tip_by_lengths

_FIELDS = dict(zip(LENGTHS, ("L1", "L2", "L3", "L4", "L6", "L7", "L8", "upper_less_lower", "inner_less_outer"), strict=True))
SIDEWAYS = "target sideways"
BASE = ("base turn x", "base turn y", "base turn z", "base x", "base y", "base z")

TOLERANCE: Mapping[str, float] = {
    **dict.fromkeys(LENGTHS, 5e-3),
    **{name: 5e-3 if IS_LENGTH[i] else np.radians(1.0) for i, name in enumerate(OFFSETS)},
    SCALE: 0.01,
    **dict.fromkeys(WIND_UPS, 0.5),
    SIDEWAYS: 5e-3,
    **dict.fromkeys(BASE[:3], 0.1),
    **dict.fromkeys(BASE[3:], 1.0),
}
"""Largest error that is expected of each parameter before the measurement [SI]; the unit of its
column."""


class Frame(NamedTuple):
    """Pose of frame 1 in the measuring frame."""

    R: Array
    t: Array
    """[m]"""


@dataclass(frozen=True, eq=False)
class TipModel:
    """Boom, readings' corrections and frame: all that predicts a measured tip."""

    boom: Boom
    offset: Array
    """(5,)"""
    scale: Array
    """(5,)"""
    wind_up: Array
    """(5,) share of the printed wind-up"""
    target: Array
    """(3,) of the measured target in frame 11, forward of the tip, up and along the pins [m]."""
    frame: Frame

    @staticmethod
    def of(boom: Boom, target: Array) -> "TipModel":
        """Return the model that a boom's file describes, in the boom's own frame."""
        known, frame = boom.calibration, Frame(np.eye(3), np.zeros(3))
        if known is None:
            return TipModel(boom, np.zeros(5), np.ones(5), np.ones(5), read_only(target), frame)
        return TipModel(boom, known.offset, known.scale, known.wind_up, read_only(target), frame)

    def values(self, names: tuple[str, ...]) -> Array:
        """Return the values of parameters; those of the base are changes, 0."""
        return np.array([self._value(name) for name in names])

    def _value(self, name: str) -> float:
        if name in LENGTHS:
            return float(getattr(self.boom.geometry, _FIELDS[name]))
        if name in OFFSETS:
            return float(self.offset[OFFSETS.index(name)])
        if name in WIND_UPS:
            return float(self.wind_up[WIND_UPS.index(name)])
        return float(self.scale[3]) if name == SCALE else float(self.target[2]) if name == SIDEWAYS else 0.0

    def changed(self, names: tuple[str, ...], by: Array) -> "TipModel":
        """Return the model with parameters changed by `by` (k,).

        Raises:
            InputError: a length becomes implausible.
        """
        lengths: dict[str, float] = {}
        offset, scale, share = (np.array(x) for x in (self.offset, self.scale, self.wind_up))
        target, turn, shift = np.array(self.target), np.zeros(3), np.zeros(3)
        for name, change in zip(names, by, strict=True):
            if name in LENGTHS:
                lengths[_FIELDS[name]] = getattr(self.boom.geometry, _FIELDS[name]) + float(change)
            elif name in OFFSETS:
                offset[OFFSETS.index(name)] += change
            elif name in WIND_UPS:
                share[WIND_UPS.index(name)] += change
            elif name == SCALE:
                scale[3] += change
            elif name == SIDEWAYS:
                target[2] += change
            elif name in BASE[:3]:
                turn[BASE.index(name)] += change
            else:
                shift[BASE.index(name) - 3] += change
        geometry: Geometry = replace(self.boom.geometry, **lengths) if lengths else self.boom.geometry
        frame = Frame(Rotation.from_rotvec(turn).as_matrix() @ self.frame.R, self.frame.t + shift)
        parts = {"offset": read_only(offset), "scale": read_only(scale), "wind_up": read_only(share)}
        return replace(self, boom=replace(self.boom, geometry=geometry), target=read_only(target), frame=frame, **parts)

    def joints(self, readings: Array, yields: Array) -> Array:
        """Return joint positions (n, 5) at readings, with the printed wind-ups `yields` (n, 5)."""
        return np.asarray(self.scale * readings + self.offset - self.wind_up * yields)

    def tip(self, readings: Array, yields: Array) -> Array:
        """Return the target's position (n, 3) in the measuring frame [m]."""
        pose = forward_kinematics(self.boom, self.joints(readings, yields))
        at = pose.position + (pose.rotation @ self.target)
        return np.asarray(at @ self.frame.R.T + self.frame.t)

    def derivative(self, names: tuple[str, ...], readings: Array, yields: Array) -> Array:
        """Return the derivative (n, 3, k) of `tip` by parameters."""
        q = self.joints(readings, yields)
        own = self._in_boom(q)
        J, R = np.zeros((len(q), 3, len(names))), self.frame.R
        at = (self.tip(readings, yields) - self.frame.t) if any(name in BASE for name in names) else None
        for k, name in enumerate(names):
            if name in BASE[:3] and at is not None:
                J[..., k] = np.cross(np.eye(3)[BASE.index(name)], at)
            elif name in BASE:
                J[..., k] = np.eye(3)[BASE.index(name) - 3]
            elif name in LENGTHS:
                J[..., k] = own.lengths[name] @ R.T
            elif name == SIDEWAYS:
                J[..., k] = own.sideways @ R.T
            else:
                i = 3 if name == SCALE else (OFFSETS if name in OFFSETS else WIND_UPS).index(name)
                factor = readings[:, 3] if name == SCALE else np.ones(len(q)) if name in OFFSETS else -yields[:, i]
                J[..., k] = (own.joints[..., i] * factor[:, None]) @ R.T
        return J

    def by_readings(self, readings: Array, yields: Array) -> Array:
        """Return the derivative (n, 3, 5) of `tip` by the readings."""
        return np.asarray(self.frame.R @ (self._in_boom(self.joints(readings, yields)).joints * self.scale))

    def _in_boom(self, q: Array) -> "_Derivatives":
        normal = np.stack([np.sin(q[:, 0]), -np.cos(q[:, 0]), np.zeros(len(q))], axis=-1)
        boom, target = self.boom, self.target
        return _Derivatives(tip_by_joints(boom, q, target), tip_by_lengths(boom, q, target), normal)


class _Derivatives(NamedTuple):
    joints: Array
    """(n, 3, 5)"""
    lengths: dict[str, Array]
    """(n, 3) each"""
    sideways: Array
    """(n, 3)"""


def candidates(boom: Boom, *, known_frame: bool, equal_links: bool) -> tuple[str, ...]:
    """Return every parameter that a calibration may look for."""
    elastic = [
        name
        for name, drive in zip(WIND_UPS, boom.drives, strict=True)
        if drive is not None and wind_up(drive.gearbox, 0.0) is not None
    ]
    lengths = [name for name in LENGTHS if not (equal_links and name in (UPPER, INNER))]
    return (*lengths, *OFFSETS, SCALE, *elastic, SIDEWAYS, *(() if known_frame else BASE))


def aligned(at: Array, measured: Array) -> Frame:
    """Return the frame that fits points (n, 3) to measured ones by least squares (Kabsch 1976).

    Raises:
        InputError: the points are fewer than 3, or on one line.
    """
    whole = np.isfinite(measured).all(axis=-1)
    if whole.sum() < 3:
        raise InputError(
            f"{int(whole.sum())} poses have all of x, y and z; the place of the boom in the measuring frame needs 3. "
            "Measure all three coordinates, or measure in the boom's own frame (--frame boom)"
        )
    a, b = at[whole], measured[whole]
    H = (a - a.mean(axis=0)).T @ (b - b.mean(axis=0))
    U, sizes, Vt = np.linalg.svd(H)
    if sizes[1] <= 1e-6 * max(sizes[0], 1e-300):
        raise InputError(
            "all tips are on one line: the boom's place in the measuring frame is open; measure at several yaw angles"
        )
    R = Vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return Frame(R, b.mean(axis=0) - R @ a.mean(axis=0))


def require_a_shape(model: TipModel, readings: Array) -> None:
    """Refuse readings at which the linkage is flat.

    Its inequality then moves the tip without bound.

    Raises:
        InputError: names the pose and what to measure instead.
    """
    delta = readings[:, 2] - readings[:, 1] + model.offset[2] - model.offset[1]
    flat = np.flatnonzero(np.abs(np.sin(delta)) < np.sin(np.radians(3.0)))
    if flat.size:
        raise InputError(
            f"pose {flat[0] + 1}: lower - inner is {np.degrees(delta[flat[0]]):.4g} deg, where the linkage is flat; "
            "measure between 3 and 177 deg, or take equal links (--linkage equal)"
        )
