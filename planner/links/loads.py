"""Loads of a link from motions: end force and acceleration of the link at every instant.

Both are along the axes of the link: x from its root to its end, y across it in the plane of the
arm. The acceleration of gravity is subtracted from accelerations. Forces along the pins, z in the
thesis, are left out, as in the thesis: their distribution over two pins is statically
indeterminate.
"""

from collections.abc import Sequence

import numpy as np

from boom_model import Boom, InputError, body_motion, inverse_dynamics, transmission_angle
from boom_model.arrays import Array, read_only
from boom_model.boom import LIMIT_TOLERANCE
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.link_design import Link, LoadCases, ThesisLoad
from planner.motion.trajectory import Trajectory

_FLAT = 1e-6
"""Transmission angle [rad] below which a linkage is flat."""


def link_cases(
    boom: Boom, link: Link, trajectories: Sequence[Trajectory], *, payload_as: PayloadAs = "mass"
) -> tuple[LoadCases, Array]:
    """Return one load case per instant of the motions, and (k, 2) its motion and time.

    The end loads come from the upper link at frame 8 for the inner link, from the outer link at
    frame 6 for the lower link, from the upper link at frame 7 for the outer link, and from the tool
    at the wrist for the extension. The extension is held at the mouth of its housing, `clamp` from
    its root.

    Raises:
        InputError: there is no motion, loads are not finite, a linkage is flat (the message names
            the instant), or its links are unequal.
    """
    boom.geometry.require_parallelogram("boom link")
    if not trajectories:
        raise InputError("no motion is given; the loads of a link need at least one")
    for i, trajectory in enumerate(trajectories):
        flat = transmission_angle(boom, trajectory.q) < _FLAT
        if link.name != "extension" and flat.any():
            at = trajectory.t[int(np.argmax(flat))]
            raise InputError(f"motion {i + 1}, t = {at:g} s: the linkage is flat, so pin forces are unbounded")
    parts = [_of_motion(boom, link, trajectory, payload_as) for trajectory in trajectories]
    instants = [np.stack([np.full(t.t.size, i), t.t], axis=-1) for i, t in enumerate(trajectories)]
    force, moment, acceleration, clamp = (np.concatenate(each) for each in zip(*parts, strict=True))
    return LoadCases.of(force, acceleration, moment, clamp), read_only(np.concatenate(instants))


def largest_components(cases: LoadCases) -> LoadCases:
    """Combine the largest values of the components, which need not occur together (section 3.5).

    The result is one case in tension and one in compression, if the cases have both. The loads of
    the link's own mass have the same sense as the end force.
    """
    fx, fy = cases.end_force.T
    across = fy[np.abs(fy).argmax()]
    along = [float(f) for f in (fx.min(), fx.max()) if f * fx[np.abs(fx).argmax()] > 0.0 or f < 0.0 < fx.max()]
    a = cases.acceleration
    # Linear in x: the largest values at the root and at 1 m bound every case between them.
    root, far = np.abs(a[..., 0]).max(axis=0), np.abs(a.sum(axis=-1)).max(axis=0)
    rows = []
    for force in dict.fromkeys(along):
        signs = -np.sign([force, across])
        rows.append(np.stack([signs * root, signs * (far - root)], axis=-1))
    ends = [[force, across] for force in dict.fromkeys(along)]
    moment = np.sign(across) * np.abs(cases.end_moment).max()
    return LoadCases.of(ends, rows, np.full(len(ends), moment), np.full(len(ends), cases.clamp.min()))


def thesis_load(boom: Boom, link: Link, trajectories: Sequence[Trajectory], *, payload_as: PayloadAs = "mass") -> ThesisLoad:
    """Return the load for the thesis's method: the largest components over motions.

    They are those of the end force, of the rates, and of the acceleration of the centre of mass.

    Raises:
        InputError: as `link_cases`, or the link is not the inner or the lower one.
    """
    if link.name not in ("inner", "lower"):
        raise InputError(f"the thesis's method is for the inner and the lower link, not for the {link.name} link")
    cases, _ = link_cases(boom, link, trajectories, payload_as=payload_as)
    rows = []
    for trajectory in trajectories:
        body = body_motion(boom, trajectory.q, trajectory.qd, trajectory.qdd)[link.name]
        felt = body.acceleration + boom.gravity * np.array([0.0, 0.0, 1.0])
        vectors = np.stack([felt, body.angular_velocity, body.angular_acceleration])
        rows.append(np.abs(np.einsum("nji,vnj->vni", body.T[:, :3, :3], vectors)).max(axis=1))
    felt_most, rate, acceleration = np.max(rows, axis=0)
    return ThesisLoad(read_only(np.abs(cases.end_force).max(axis=0)), *(read_only(v) for v in (felt_most, rate, acceleration)))


def _of_motion(boom: Boom, link: Link, trajectory: Trajectory, payload_as: PayloadAs) -> tuple[Array, Array, Array, Array]:
    q, qd, qdd = trajectory.q, trajectory.qd, trajectory.qdd
    loads = inverse_dynamics(boom, q, qd, qdd, payload_as=payload_as)
    motions = body_motion(boom, q, qd, qdd)
    body = motions[link.name]
    up = np.array([0.0, 0.0, 1.0])
    moment, clamp = np.zeros(len(q)), np.zeros(len(q))
    # The link's axes in frame 1: along it, and across it in the arm's plane.
    angle = q[:, 1] if link.name in ("inner", "outer") else q[:, 2]
    forward = np.stack([np.cos(q[:, 0]), np.sin(q[:, 0]), np.zeros(len(q))], axis=-1)
    e = np.cos(angle)[:, None] * forward + np.sin(angle)[:, None] * up
    p = -np.sin(angle)[:, None] * forward + np.cos(angle)[:, None] * up
    if loads.pins is None:
        raise RuntimeError("reactions were asked for")
    if link.name == "extension":
        # Reaction of tool and payload at the wrist. The beam points along -e.
        e = -e
        force = np.zeros((len(q), 3))
        for name, mass in (("end_effector", boom.bodies["end_effector"].mass), ("payload", boom.payload.mass)):
            moving = motions[name].acceleration if name != "payload" or payload_as == "mass" else 0.0
            force -= mass * (moving + boom.gravity * up)
        moment = loads.tau[:, 4] * 1.0
        clamp = np.clip(link.length - np.maximum(q[:, 3], 0.0), 0.0, link.length * (1.0 - LIMIT_TOLERANCE))
        root = body.T[:, :3, 3] - link.length * e
    else:
        pin = {"inner": -loads.pins.frame_8, "lower": -loads.pins.frame_6, "outer": -loads.pins.frame_7}[link.name]
        # Pin forces are given in frame 4, which yaws with the arm.
        force = pin[:, :1] * forward + pin[:, 2:] * up
        root = body.T[:, :3, 3]
    w, w1 = body.angular_velocity, body.angular_acceleration
    r = root - body.com
    felt = body.acceleration + np.cross(w1, r) + np.cross(w, np.cross(w, r)) + boom.gravity * up
    rise = np.cross(w1, e) + np.cross(w, np.cross(w, e))
    both = np.stack([felt, rise], axis=-1)
    acceleration = np.stack([np.einsum("ni,nik->nk", axis, both) for axis in (e, p)], axis=1)
    across = np.stack([(force * e).sum(axis=-1), (force * p).sum(axis=-1)], axis=-1)
    return across, moment, acceleration, clamp
