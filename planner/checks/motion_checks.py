"""A motion held against the joint limits and the drives' datasheets, row by row."""

from collections.abc import Iterator

import numpy as np

from boom_model import JOINTS, BaseMotion, Basis, Boom, Drive, Loads, Origin, inverse_dynamics, mass_matrix, transmission_angle
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LIMIT_TOLERANCE
from boom_model.dynamics.newton_euler import PayloadAs
from planner.checks.drives.actuator import actuator_rows
from planner.checks.drives.duty import Duty
from planner.checks.drives.gearbox import gearbox_rows
from planner.checks.drives.joint_view import JointView, Shock
from planner.checks.drives.motor import motor_rows
from planner.checks.drives.tip import tip_rows
from planner.checks.rows import Row, Verdict, held, overall
from planner.motion.trajectory import Trajectory
from planner.paths.clearance import nearest_approach
from planner.timing.travel_mean import average_torque

__all__ = ["ANGLE_CHECKS", "Row", "Shock", "Verdict", "average_torque", "check_rows", "drive_rows", "joint_views", "overall"]

ANGLE_CHECKS = ("position", "lower - inner", "transmission angle")
"""Checks whose margin is a distance to the bound."""

INERTIA_POSES = 1000
"""Poses of a motion, evenly spread, at which its inertia is looked at."""


def check_rows(
    boom: Boom,
    trajectory: Trajectory,
    loads: Loads,
    *,
    base: BaseMotion | None = None,
    payload_as: PayloadAs = "mass",
    shock: Shock | None = None,
    bases: tuple[Basis, ...] = (),
    duty: Duty | None = None,
) -> tuple[Row, ...]:
    """Every check of a motion: positions, speeds, accelerations and jerk, then each joint's drive, the mount, and the tip.

    Args:
        loads: the motion's own, from `inverse_dynamics`, with its reactions.
        base: how the vehicle moves the base; the static torques take its tilt.
        payload_as: how the loads took the payload; the static torques take it alike.
        shock: the vehicle's, which a gearbox may meet up to its momentary peak torque; None without one.
        bases: how far the data behind the torques themselves can be trusted, the vehicle's for example.
        duty: the cycle that the samples stand for; None is the motion alone.
    """
    duty = Duty.alone(trajectory.t) if duty is None else duty
    M = _inertia(boom, trajectory)
    rows: list[Row] = []
    for i in range(5):
        rows += _position_rows(boom, trajectory, i)
        rows += _rate_rows(boom, trajectory, i)
    views = joint_views(boom, trajectory, loads.tau, M, base=base, payload_as=payload_as, shock=shock, bases=bases, duty=duty)
    for view, drive in zip(views, boom.drives, strict=True):
        if drive is not None:
            rows += drive_rows(view, drive, shock)
        elif view.is_length and boom.actuator is not None:
            rows += actuator_rows(view, boom.actuator, float(boom.limits.lower[view.index]))
        else:
            rows += _undriven_rows(view)
    rows += _mount_rows(boom, trajectory.t, loads)
    rows += _clearance_rows(boom, trajectory)
    rows += tip_rows(boom, trajectory, loads.tau, duty, M, Basis.weakest(view.basis for view in views))
    return tuple(rows)


def joint_views(
    boom: Boom,
    trajectory: Trajectory,
    tau: Array,
    M: Array | None = None,
    *,
    base: BaseMotion | None = None,
    payload_as: PayloadAs = "mass",
    shock: Shock | None = None,
    bases: tuple[Basis, ...] = (),
    duty: Duty | None = None,
) -> tuple[JointView, ...]:
    """The motion as each joint sees it.

    Args:
        tau: (n, 5) the motion's torques.
        M: (m, 5, 5) mass matrix at some of its poses; None computes it.
        base, payload_as, shock, bases, duty: as of `check_rows`.
    """
    still = np.zeros_like(trajectory.q)
    tilt = None if base is None else BaseMotion.of(up=base.up)
    static = inverse_dynamics(boom, trajectory.q, still, still, base=tilt, payload_as=payload_as, reactions=False).tau
    M = _inertia(boom, trajectory) if M is None else M
    friction = boom.friction
    return tuple(
        JointView(
            joint=JOINTS[i],
            is_length=bool(IS_LENGTH[i]),
            trajectory=trajectory,
            duty=Duty.alone(trajectory.t) if duty is None else duty,
            tau=tau[:, i],
            calm=tau[:, i] if shock is None else shock.calm[:, i],
            friction=friction.viscous[i] * trajectory.qd[:, i] + friction.coulomb[i] * np.sign(trajectory.qd[:, i]),
            coulomb=float(friction.coulomb[i]),
            static=static[:, i],
            inertia=M[:, i, i],
            index=i,
            basis=Basis.weakest([*bases, *(o.basis for o in (friction.origins[i],) if o is not None)]),
            steady=base is None or base.up.ndim == 1 or bool(np.ptp(base.up, axis=0).max() == 0.0),
        )
        for i in range(5)
    )


def _inertia(boom: Boom, trajectory: Trajectory) -> Array:
    count = len(trajectory.t)
    poses = np.unique(np.linspace(0, count - 1, min(count, INERTIA_POSES)).astype(int))
    return mass_matrix(boom, trajectory.q[poses])


def _position_rows(boom: Boom, trajectory: Trajectory, i: int) -> Iterator[Row]:
    limits, unit = boom.limits, "m" if IS_LENGTH[i] else "rad"
    q = trajectory.q[:, i]
    excess = np.maximum(limits.lower[i] - q, q - limits.upper[i])
    at = int(np.argmax(excess))
    nearest = limits.lower[i] if abs(q[at] - limits.lower[i]) <= abs(q[at] - limits.upper[i]) else limits.upper[i]
    yield _room(JOINTS[i], "position", q[at], nearest, -excess[at], unit, trajectory.t[at], limits.origins["position"][i])
    if JOINTS[i] == "lower":
        gap = trajectory.q[:, 2] - trajectory.q[:, 1]
        at = int(np.argmin(gap))
        room = gap[at] - limits.linkage
        yield _room(
            "lower",
            "lower - inner",
            gap[at],
            limits.linkage,
            room,
            unit,
            trajectory.t[at],
            limits.origins["linkage"][0],
        )
        angle = transmission_angle(trajectory.q)
        at, origin = int(np.argmin(angle)), limits.origins["transmission"][0]
        room = float(angle[at] - limits.transmission)
        facts = (float(angle[at]), limits.transmission, unit, room, 0.0, float(trajectory.t[at]))
        verdict = Verdict.PASS if room >= 0.0 else Verdict.WARN  # near the flat parallelogram the pins' forces grow
        yield Row("lower", "transmission angle", *facts, verdict, origin.basis, origin.source)


def _room(joint: str, check: str, demand: float, limit: float, room: float, unit: str, at: float, origin: Origin) -> Row:
    verdict = Verdict.PASS if room >= -LIMIT_TOLERANCE else Verdict.FAIL
    room = 0.0 if abs(room) <= LIMIT_TOLERANCE else float(room)
    return Row(joint, check, float(demand), float(limit), unit, room, 0.0, float(at), verdict, origin.basis, origin.source)


def _clearance_rows(boom: Boom, trajectory: Trajectory) -> Iterator[Row]:
    """The arm's nearest approach to what it must keep away from, as the mount carries it."""
    keep = boom.keep_out
    if keep is None:
        return
    at, found = nearest_approach(boom, trajectory.q)
    origins = [keep.origin, *(shape.origin for shape in keep.shapes if shape.name == found.shape)]
    origin = Origin(Basis.weakest([each.basis for each in origins]), "; ".join(each.source for each in origins))
    check, room = f"clearance of {found.link} to {found.shape}", found.distance - keep.clearance
    yield _room("arm", check, found.distance, keep.clearance, room, "m", float(trajectory.t[at]), origin)


def _rate_rows(boom: Boom, trajectory: Trajectory, i: int) -> Iterator[Row]:
    base = "m" if IS_LENGTH[i] else "rad"
    for power, (name, values) in enumerate(
        (("velocity", trajectory.qd), ("acceleration", trajectory.qdd), ("jerk", trajectory.qddd)), start=1
    ):
        if values is None:
            continue
        at = int(np.argmax(np.abs(values[:, i])))
        unit = f"{base}/s" if power == 1 else f"{base}/s^{power}"
        limit = float(getattr(boom.limits, name)[i])
        yield held(
            JOINTS[i],
            name,
            float(abs(values[at, i])),
            limit,
            unit,
            float(trajectory.t[at]),
            boom.limits.origins[name][i],
        )


def _undriven_rows(view: JointView) -> Iterator[Row]:
    """What a joint asks of a drive that is not given."""
    torque, rate = ("N", "m/s") if view.is_length else ("Nm", "rad/s")
    origin = Origin(Basis.PRINTED, "NOT CHECKED: no drive data")
    force = "force" if view.is_length else "torque"
    for check, values, unit in (
        (f"drive peak {force}", view.tau, torque),
        ("drive top speed", view.qd, rate),
        ("drive peak power", view.tau * view.qd, "W"),
        ("drive worst hold", view.static, torque),
    ):
        peak, at = view.peak(values)
        yield view.held(check, peak, None, unit, at, origin)
    rms = view.duty.mean(view.tau**2) ** 0.5
    yield view.held(f"drive RMS {force}", rms, None, torque, None, origin)


def drive_rows(view: JointView, drive: Drive, shock: Shock | None) -> Iterator[Row]:
    """Every check of a joint's gearbox and motor."""
    yield from gearbox_rows(view, drive, shock)
    yield from motor_rows(view, drive)


def _mount_rows(boom: Boom, t: Array, loads: Loads) -> Iterator[Row]:
    if loads.mount is None:
        return
    parts = (("force", "N", loads.mount[:, :3], boom.mount.force), ("moment", "Nm", loads.mount[:, 3:], boom.mount.moment))
    for name, unit, vectors, bearable in parts:
        size = np.linalg.norm(vectors, axis=-1)
        at = int(np.argmax(size))
        origin = Origin(Basis.PRINTED, "no limit of the vehicle's mount is given") if bearable is None else bearable.origin
        limit = None if bearable is None else bearable.value
        yield held("mount", f"peak {name}", float(size[at]), limit, unit, float(t[at]), origin)
