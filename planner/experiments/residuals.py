"""Torques of a log that two models leave unexplained, and what the second model explains better.

With the log's torque tau and the parts p of a model's torque, r = tau - sum p is the residual. The
two models' parts differ by d_p = p_after - p_before, so r_before - r_after = sum d_p, and exactly

    |r_before|^2 - |r_after|^2 = sum over parts <r_before + r_after, d_p>

Each term over |r_before|^2 is the share of the residual that a part takes away. It is negative
where the part makes it worse. Only samples count in which the joint moves, because dry friction has
no known direction in the others.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from boom_model import JOINTS, Boom, InputError, breakdown, forward_kinematics, tip_deviation
from boom_model.arrays import Array, Mask
from boom_model.boom import LOAD_UNITS
from boom_model.dynamics.newton_euler import PayloadAs
from planner.experiments.comparison import Log
from planner.experiments.readings import Readings, readings_of

PARTS = ("gravity", "inertia", "velocity", "payload", "friction", "drive inertia")
"""Parts of a torque, as in `breakdown`. The last is the drives', if the torques accelerate them."""

HEADER = ("joint", "before", "after", "noise", "factor", "taken away by")
"""Columns of `cells`: RMS of the torque that a model leaves."""
PARTS_HEADER = ("joint", "part", "before", "after", "takes away")
"""Columns of `part_cells`: RMS of a part of the model's torque, and its share of the residual."""

_MOST = 4000  # samples at which the models are computed
_ALIKE = 1.1  # times the noise of the torques, below which a residual may grow
_SAME = 1e-6  # [m]
_SHOWN = 0.01  # least share that the short table names


@dataclass(frozen=True, eq=False)
class Fit:
    """What one model makes of the log."""

    boom: Boom
    q: Array
    """(n, 5) joint positions, by the calibration of this boom"""
    parts: dict[str, Array]
    """(n, 5) each, by PARTS"""
    total: Array
    """(n, 5) torque of the model, the sum of its parts [Nm, N]"""
    residual: Array
    """(n, 5) torque of the log less that of the model"""
    tip: Array
    """(n, 3) in frame 1 [m]"""
    tip_sd: Array | None
    """(n,) standard deviation of the tip, see `tip_deviation` [m]; None without a calibration."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """A log beside two models of the machine."""

    t: Array
    """(n,) on the clock of the log [s]"""
    tau: Array
    """(n, 5) measured torques"""
    used: Mask
    """(n, 5) where a joint moves"""
    before: Fit
    after: Fit
    noise: Array
    """(5,) standard deviation of the measured torques from sample to sample"""
    notes: tuple[str, ...]

    @cached_property
    def rms(self) -> Array:
        """(2, 5) RMS of the residuals before and after; NaN for a joint that does not move."""
        count = self.used.sum(axis=0)
        squares = np.stack([(fit.residual**2 * self.used).sum(axis=0) for fit in (self.before, self.after)])
        return np.asarray(np.sqrt(np.where(count > 0, squares / np.maximum(count, 1), np.nan)))

    @cached_property
    def shares(self) -> dict[str, Array]:
        """(5,) of each part.

        These and what is left, the squared ratio of the residuals, add up to 1.
        """
        both = (self.before.residual + self.after.residual) * self.used
        whole = np.maximum((self.before.residual**2 * self.used).sum(axis=0), np.finfo(float).tiny)
        return {
            name: (both * (self.after.parts[name] - self.before.parts[name])).sum(axis=0) / whole for name in self.after.parts
        }

    @property
    def apart(self) -> Array:
        """(n,) distance between the tips of the two models [m]."""
        return np.asarray(np.linalg.norm(self.after.tip - self.before.tip, axis=-1))

    @property
    def worse(self) -> tuple[str, ...]:
        """Joints whose torque the second model explains worse, beyond the noise."""
        before, after = self.rms
        return tuple(j for i, j in enumerate(JOINTS) if after[i] > max(before[i], _ALIKE * self.noise[i]))

    def to_json(self) -> dict[str, Any]:
        """Return the object `before_after` of `boom compare`, in SI."""
        apart, sd = self.apart, self.after.tip_sd
        at = int(apart.argmax())
        return {
            "samples": len(self.t),
            "from_s": float(self.t[0]),
            "to_s": float(self.t[-1]),
            "joints": [self._joint(i) for i in range(5)],
            "worse": list(self.worse),
            "tip": {
                "peak_m": float(apart[at]),
                "at_s": float(self.t[at]),
                "rms_m": _rms(apart),
                "before_m": self.before.tip[at].tolist(),
                "after_m": self.after.tip[at].tolist(),
                "after_sd_m": None if sd is None else float(np.nanmax(sd)),
            },
            "notes": list(self.notes),
        }

    def _joint(self, i: int) -> dict[str, Any]:
        used = self.used[:, i]
        before, after = (_number(x) for x in self.rms[:, i])
        factor = None if before is None or not after else before / after
        parts = {
            name: {
                "before_rms": _rms(self.before.parts[name][used, i]),
                "after_rms": _rms(self.after.parts[name][used, i]),
                "change_rms": _rms((self.after.parts[name] - self.before.parts[name])[used, i]),
                "taken_away": float(self.shares[name][i]),
            }
            for name in self.after.parts
        }
        return {
            "joint": JOINTS[i],
            "unit": LOAD_UNITS[i],
            "samples": int(used.sum()),
            "before_rms": before,
            "after_rms": after,
            "noise": float(self.noise[i]),
            "factor": factor,
            "parts": parts,
        }


def residuals(
    before: Boom,
    after: Boom,
    log: Log,
    *,
    drive_inertia: bool = False,
    payload_as: PayloadAs = "mass",
    cutoff: float | None = None,
) -> Residuals:
    """Return what two models leave of the torques of a log.

    Positions are filtered without delay, as `identify` does. Each model applies its own calibration
    to the readings.

    Args:
        before: the boom as it was designed.
        after: the boom as measured, with the same payload.
        log: readings of the joints and torques.
        drive_inertia: whether the torques accelerate the drives' own inertia, as those computed
            from motor currents do.
        payload_as: see `inverse_dynamics`.
        cutoff: of the filter [Hz]; None selects the narrowest that removes noise alone.

    Raises:
        InputError: the payloads differ, or as `readings_of`, but that a joint may be at rest.
    """
    a, b = before.payload.mass, after.payload.mass
    if a != b:
        raise InputError(f"payload is {a:g} kg before and {b:g} kg after; give the one that the log has by --payload")
    readings = readings_of(log, cutoff, every_joint=False)
    some = readings.part(slice(None, None, max(1, -(-len(readings.t) // _MOST))))
    still = [joint for i, joint in enumerate(JOINTS) if not some.moving[:, i].any()]
    notes = [*readings.notes, *(f"{joint} does not move: its torques are left out" for joint in still)]
    if len(some.t) < len(readings.t):
        notes.append(f"the models are computed at {len(some.t)} of {len(readings.t)} samples")
    return Residuals(
        t=some.t,
        tau=some.tau,
        used=some.moving,
        before=_fit(before, some, drive_inertia, payload_as),
        after=_fit(after, some, drive_inertia, payload_as),
        noise=readings.torque_noise,
        notes=tuple(notes),
    )


def _fit(boom: Boom, readings: Readings, drive_inertia: bool, payload_as: PayloadAs) -> Fit:
    readings = readings.calibrated(boom)
    q, qd, qdd = readings.q, readings.qd, readings.qdd
    found = breakdown(boom, q, qd, qdd, payload_as=payload_as, friction=True)
    parts = {name: getattr(found, name) for name in PARTS if hasattr(found, name)}
    if drive_inertia:
        parts["drive inertia"] = boom.drive_inertia * qdd
    total = np.sum(list(parts.values()), axis=0)
    return Fit(
        boom=boom,
        q=q,
        parts=parts,
        total=total,
        residual=readings.tau - total,
        tip=forward_kinematics(boom, q).position,
        tip_sd=tip_deviation(boom, q),
    )


def cells(joint: dict[str, Any]) -> tuple[str, ...]:
    """Return a joint of `Residuals.to_json` as table cells under HEADER."""
    named = f"{joint['joint']} [{joint['unit']}]"
    if joint["before_rms"] is None:
        return named, "-", "-", f"{joint['noise']:.3g}", "-", "does not move"
    factor = "-" if joint["factor"] is None else f"{joint['factor']:.3g}"
    figures = (f"{joint[key]:.3g}" for key in ("before_rms", "after_rms", "noise"))
    return named, *figures, factor, by_parts(joint)


def by_parts(joint: dict[str, Any], most: int = 2) -> str:
    """Return the parts that take away most of a joint's residual, in words."""
    shares = sorted(((part["taken_away"], name) for name, part in joint["parts"].items()), key=lambda x: -abs(x[0]))
    return ", ".join(f"{name} {share:.0%}" for share, name in shares[:most] if abs(share) >= _SHOWN) or "nothing"


def part_cells(joint: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the parts of a joint of `Residuals.to_json` as rows under PARTS_HEADER."""
    named = f"{joint['joint']} [{joint['unit']}]"
    return [
        (named, name, f"{part['before_rms']:.3g}", f"{part['after_rms']:.3g}", f"{part['taken_away']:.1%}")
        for name, part in joint["parts"].items()
        if max(part["before_rms"], part["after_rms"]) > 0.0
    ]


def tip_sentence(tip: dict[str, Any]) -> str:
    """Return how far the two models' tips are apart, and how sure the second one is."""
    if tip["peak_m"] < _SAME:
        said = "both models put the tip in the same place"
    else:
        said = f"tips of the two models up to {tip['peak_m'] * 1e3:.2f} mm apart, at {tip['at_s']:.3f} s"
        said += f"; RMS {tip['rms_m'] * 1e3:.2f} mm"
    sd = tip["after_sd_m"]
    return said if sd is None else f"{said}; standard deviation after at most {sd * 1e3:.2f} mm"


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def _number(value: float) -> float | None:
    return None if np.isnan(value) else float(value)
