"""What the page shows of one joint position: figures, torque bars and arrows."""

from dataclasses import dataclass

import numpy as np

from boom_model import (
    JOINTS,
    Boom,
    Loads,
    body_transforms,
    forward_kinematics,
    inverse_dynamics,
    tip_deflection,
    transmission_angle,
)
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from boom_model.drives.limits import gear_limits, motor_limits
from planner.page.vehicle import Slope
from planner.recording.arrows import Scale, arrow_scale, arrows


@dataclass(frozen=True)
class Figure:
    """One displayed number."""

    name: str
    """Identifier in the page."""
    label: str
    value: float
    unit: str
    digits: int
    warns: bool = False
    """Whether it is beyond a guideline."""

    @property
    def text(self) -> str:
        """The number as displayed."""
        return fixed(self.value, self.digits)


@dataclass(frozen=True)
class Bar:
    """Static torque of a joint beside what its drive allows at standstill."""

    joint: str
    torque: float
    """[Nm], the extension's force [N]"""
    unit: str
    gearbox: float | None
    """Start-stop torque of the gearbox; None where none is known."""
    motor: float | None
    """Torque of the motor at standstill less the stepper margin, or the actuator's static force;
    None likewise."""

    @property
    def limit(self) -> float | None:
        """The smaller limit; None where none is known."""
        return min((limit for limit in (self.gearbox, self.motor) if limit is not None), default=None)

    @property
    def used(self) -> float | None:
        """Share of the limit that is used; above 1 the drive cannot hold the load."""
        return None if self.limit is None else abs(self.torque) / self.limit if self.limit > 0.0 else np.inf

    @property
    def decides(self) -> str:
        """The part with the smaller limit."""
        if self.limit is None:
            return ""
        return "gearbox" if self.limit == self.gearbox else "actuator" if self.joint == "extension" else "motor"


@dataclass(frozen=True, eq=False)
class PoseView:
    """Everything about a joint position that the page shows."""

    figures: tuple[Figure, ...]
    bars: tuple[Bar, ...]
    bodies: dict[str, Array]
    """(4, 4) T_1_body of every body and of the tip."""
    arrows: tuple[tuple[str, Array, Array], ...]
    """Name, foot (3,) and vector (3,) of each arrow in frame 1 [m]."""
    scale: Scale
    """What a metre of arrow stands for."""
    tip: Array
    """(3,) [m]"""


def pose_view(boom: Boom, q: Array, slope: Slope) -> PoseView:
    """Return the figures of a joint position (5,) at rest on a slope."""
    still = np.zeros(5)
    loads = inverse_dynamics(boom, q, still, still, base=slope.base)
    tip = forward_kinematics(boom, q)
    sampled = _as_samples(loads)
    scale = arrow_scale(sampled)
    drawn = tuple((name, foot[0], vector[0]) for name, foot, vector in arrows(boom, q[None], sampled, scale))
    figures = (*_tip_figures(boom, q, tip.position, float(tip.pitch), loads), *_load_figures(loads))
    return PoseView(figures, _bars(boom, loads.tau), body_transforms(boom, q), drawn, scale, tip.position)


def fixed(value: float, digits: int) -> str:
    """Return a number with fixed digits, and no minus before a zero.

    >>> fixed(-0.00001, 2)
    '0.00'
    """
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _tip_figures(boom: Boom, q: Array, position: Array, pitch: float, loads: Loads) -> tuple[Figure, ...]:
    angle, sag = float(transmission_angle(boom, q)), tip_deflection(boom, q, loads.tau)
    return (
        *(Figure(f"tip_{axis}", f"tip {axis}", float(at), "m", 4) for axis, at in zip("xyz", position, strict=True)),
        Figure("tip_pitch", "pitch of the end effector", float(np.degrees(pitch)), "deg", 2),
        Figure(
            "transmission", "transmission angle", float(np.degrees(angle)), "deg", 2, warns=angle < boom.limits.transmission
        ),
        Figure("sag", "tip sag by gear wind-up", -1e3 * float(sag.wind_up[2]), "mm", 3),
        Figure("deflection", "tip, all play of the drives", 1e3 * float(sag.total), "mm", 3),
    )


def _load_figures(loads: Loads) -> tuple[Figure, ...]:
    if loads.pins is None or loads.mount is None:
        return ()
    pins = (Figure(f"pin_{k}", f"force at pin {k}", _size(getattr(loads.pins, f"frame_{k}")), "N", 1) for k in (6, 7, 8))
    force, moment = loads.mount[:3], loads.mount[3:]
    wrench = [(f"mount_F{a}", f"force on the mount, {a}", f, "N") for a, f in zip("xyz", force, strict=True)]
    wrench += [(f"mount_M{a}", f"moment on the mount, {a}", m, "Nm") for a, m in zip("xyz", moment, strict=True)]
    return (*pins, *(Figure(name, label, float(value), unit, 1) for name, label, value, unit in wrench))


def _bars(boom: Boom, tau: Array) -> tuple[Bar, ...]:
    gear, motor = gear_limits(boom), motor_limits(boom, np.zeros(5))
    bars = []
    for i, joint in enumerate(JOINTS):
        by_motor = _known(motor[i])
        if IS_LENGTH[i] and boom.actuator is not None:
            by_motor = boom.actuator.actuator.static_force
        bars.append(Bar(joint, float(tau[i]), LOAD_UNITS[i], _known(gear[i]), by_motor))
    return tuple(bars)


def _known(limit: float) -> float | None:
    return float(limit) if np.isfinite(limit) else None


def _size(vector: Array) -> float:
    return float(np.linalg.norm(vector))


def _as_samples(loads: Loads) -> Loads:
    """Return the loads of one state as those of one sample."""
    assert loads.pins is not None
    assert loads.mount is not None
    pins = type(loads.pins)(*(getattr(loads.pins, f"frame_{k}")[None] for k in (6, 7, 8)))
    return Loads(loads.tau[None], pins, loads.mount[None])
