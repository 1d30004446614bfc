"""Independent models of the boom that tests hold `boom_model` against: MuJoCo, Pinocchio and the
textbook recursion.

MuJoCo and Pinocchio get an open tree with a joint for every link of the linkage, rooted in a free
body that is frame 1. The parallelogram makes the tree's coordinates linear in the boom's: x = G q,
and so the closed linkage needs tau = G^T tau_tree. The textbook form takes the frames of the DH
tables through eqs. 2.39-2.46 of the thesis (as corrected), one state at a time, and turns forces
into torques by virtual work.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Body, Boom, Friction
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.kinematics.frames import BODY_FRAMES, Loop, body_transforms, dh_rows, frame_transforms

UP = np.array([0.0, 0.0, 1.0])


class TreeLink(NamedTuple):
    """A body of the tree, on a joint along its own z axis; its frame is the one of
    `BODY_FRAMES`."""

    body: str
    parent: str
    position: tuple[float, float, float]
    """of the body's frame in its parent's, where the joint's coordinate is 0 [m]"""
    axes: tuple[tuple[int, int, int], tuple[int, int, int]]
    """x and y axis of the body's frame in its parent's, there"""
    row: tuple[int, int, int, int, int]
    """of G: the joint's coordinate is row . q"""
    slides: bool = False

    @property
    def rotation(self) -> Array:
        x, y = np.array(self.axes, dtype=float)
        return np.column_stack([x, y, np.cross(x, y)])


class OracleLoads(NamedTuple):
    """What an oracle says of n states."""

    tau: Array
    """(n, 5)"""
    mount: Array
    """(n, 6) force and moment of the boom on the mount, in and about frame 1."""


class ClosedLoads(NamedTuple):
    """What the closed loop of n states needs."""

    tau: Array
    """(n, 5)"""
    pin_7: Array
    """(n, 3) force of the outer link on the upper one, in frame 4."""
    mount: Array
    """(n, 6) as in `OracleLoads`."""


class ComMotion(NamedTuple):
    """Motion of a body over the ground, (n, 3) each, along frame 1."""

    com: Array
    velocity: Array
    angular_velocity: Array
    acceleration: Array
    angular_acceleration: Array


def tree(boom: Boom) -> list[TreeLink]:
    """The boom cut open at pin 7: base, then lower and outer, then inner and all that hangs on it,
    depth first."""
    g = boom.geometry
    parallel, raised = ((1, 0, 0), (0, 1, 0)), ((1, 0, 0), (0, 0, 1))
    shoulder = (g.L2, 0.0, g.L1)
    return [
        TreeLink("base", "mount", (0.0, 0.0, 0.0), parallel, (1, 0, 0, 0, 0)),
        TreeLink("lower", "base", shoulder, raised, (0, 0, 1, 0, 0)),
        TreeLink("outer", "lower", (g.L3, 0.0, 0.0), parallel, (0, 1, -1, 0, 0)),
        TreeLink("inner", "base", shoulder, raised, (0, 1, 0, 0, 0)),
        TreeLink("upper", "inner", (g.L9, 0.0, 0.0), ((0, -1, 0), (1, 0, 0)), (0, -1, 1, 0, 0)),
        TreeLink("extension", "upper", (g.L6, -g.L7, 0.0), ((-1, 0, 0), (0, 0, -1)), (0, 0, 0, 1, 0), slides=True),
        TreeLink("end_effector", "extension", (0.0, 0.0, 0.0), raised, (0, 0, 0, 0, 1)),
    ]


def tree_matrix(boom: Boom) -> Array:
    """G (7, 5) of x = G q."""
    return np.array([link.row for link in tree(boom)], dtype=float)


def mujoco_model(boom: Boom, *, payload_as: PayloadAs = "mass") -> mujoco.MjModel:
    """The tree in MuJoCo, on a free root, with sites at the tip, the payload and either half of pin
    7.

    MuJoCo wants mass on a free root: it gets 1 kg and 1 kg m^2, which `mujoco_inverse_dynamics`
    takes off again.
    """
    g, payload = boom.geometry, boom.payload
    top = ElementTree.Element("mujoco")
    ElementTree.SubElement(top, "compiler", angle="radian")
    option = ElementTree.SubElement(top, "option", gravity=_text(-boom.gravity * UP))
    ElementTree.SubElement(option, "flag", contact="disable", constraint="disable")
    world = ElementTree.SubElement(top, "worldbody")
    bodies = {"mount": ElementTree.SubElement(world, "body", name="mount")}
    ElementTree.SubElement(bodies["mount"], "freejoint")
    _inertial(bodies["mount"], mass=1.0, diaginertia=[1.0, 1.0, 1.0])
    for link in tree(boom):
        pose = {"pos": _text(link.position), "xyaxes": _text(link.axes)}
        element = ElementTree.SubElement(bodies[link.parent], "body", pose, name=link.body)
        ElementTree.SubElement(element, "joint", type="slide" if link.slides else "hinge", axis="0 0 1")
        _rigid(element, boom.bodies[link.body])
        bodies[link.body] = element
    held = ElementTree.SubElement(bodies["end_effector"], "body", name="payload", pos=_text([g.L8, 0.0, 0.0]))
    if payload_as == "mass":
        _rigid(held, payload)
    ElementTree.SubElement(held, "site", name="tip")
    ElementTree.SubElement(held, "site", name="payload", pos=_text(payload.com))
    ElementTree.SubElement(bodies["outer"], "site", name="pin 7 of outer", pos=_text([g.L4, 0.0, 0.0]))
    ElementTree.SubElement(bodies["upper"], "site", name="pin 7 of upper", pos=_text([0.0, g.L5, 0.0]))
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(top, encoding="unicode"))


def mujoco_kinematics(boom: Boom, q: Array) -> mujoco.MjData:
    """Bodies and sites placed at q (5,), frame 1 at the world's origin."""
    model = mujoco_model(boom)
    data = mujoco.MjData(model)
    data.qpos[7:] = tree_matrix(boom) @ q
    mujoco.mj_kinematics(model, data)
    return data


def mujoco_motion(boom: Boom, q: Array, qd: Array, qdd: Array, base: BaseMotion) -> dict[str, ComMotion]:
    """Motion of every body of n states (n, 5)."""
    model = mujoco_model(boom)
    model.opt.gravity[:] = 0.0  # MuJoCo counts it as an acceleration
    data, body_kind, six = mujoco.MjData(model), mujoco.mjtObj.mjOBJ_BODY, np.empty(6)
    ids = {name: model.body(name).id for name in (*boom.bodies, "payload")}
    motions = {name: np.empty((len(q), 5, 3)) for name in ids}
    for i, (state, now) in enumerate(zip(_tree_states(boom, q, qd, qdd), instants(base, len(q)), strict=True)):
        R = ground_axes(now.up)
        _mujoco_move(data, R, now, state)
        mujoco.mj_inverse(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        for name, id_ in ids.items():
            motions[name][i, 0] = data.xipos[id_] @ R
            mujoco.mj_objectVelocity(model, data, body_kind, id_, six, 0)
            motions[name][i, 1:3] = six[3:] @ R, six[:3] @ R
            mujoco.mj_objectAcceleration(model, data, body_kind, id_, six, 0)
            motions[name][i, 3:5] = six[3:] @ R, six[:3] @ R
    return {name: ComMotion(*np.moveaxis(parts, 1, 0)) for name, parts in motions.items()}


def mujoco_inverse_dynamics(
    boom: Boom,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    payload_as: PayloadAs = "mass",
    base: BaseMotion | None = None,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
) -> OracleLoads:
    """Joint torques and the wrench of the free root by `mj_inverse` for states (n, 5)."""
    model = mujoco_model(boom, payload_as=payload_as)
    data, held = mujoco.MjData(model), model.body("payload").id
    weight, still = -_hanging(boom, payload_as) * boom.gravity * UP, np.zeros(3)
    needed = np.empty((len(q), model.nv))
    forces, moments = (np.broadcast_to(x, (len(q), 3)) for x in (tip_force, tip_moment))
    outside = zip(instants(base, len(q)), forces, moments, strict=True)
    for row, state, (now, force, moment) in zip(needed, _tree_states(boom, q, qd, qdd), outside, strict=True):
        R = ground_axes(now.up)
        _mujoco_move(data, R, now, state)
        mujoco.mj_inverse(model, data)
        given = np.zeros(model.nv)
        mujoco.mj_applyFT(model, data, weight, still, data.site("payload").xpos, held, given)
        mujoco.mj_applyFT(model, data, R @ force, R @ moment, data.site("tip").xpos, held, given)
        row[:] = data.qfrc_inverse - given
        row[:3] = row[:3] @ R  # a free joint's force is along the world's axes, its moment along the body's
        row[:6] -= *(now.acceleration + boom.gravity * now.up), *now.angular_acceleration
    return _closed(boom, needed)


def mujoco_closed_loop(boom: Boom, q: Array, qd: Array, qdd: Array, base: BaseMotion | None = None) -> ClosedLoads:
    """Loads of n states (n, 5) by Lagrange multipliers on MuJoCo's tree, for links of any lengths.

    MuJoCo's Jacobians of either half of pin 7 close the loop in position (by Newton's method),
    velocity and acceleration. The passive joints at pins 6 and 8 bear no torque, which gives the
    force at pin 7.
    """
    model = mujoco_model(boom)
    data, halves = mujoco.MjData(model), [model.site(f"pin 7 of {link}").id for link in ("upper", "outer")]
    active, passive, G = [0, 3, 1, 5, 6], [2, 4], tree_matrix(boom)  # joints of the tree, in the order of q

    def gap_jacobian() -> Array:
        each = np.zeros((2, 3, model.nv))
        for jacobian, site in zip(each, halves, strict=True):
            mujoco.mj_jacSite(model, data, jacobian, None, site)
        return np.asarray(each[0] - each[1])

    tau, pin, mount = np.empty((len(q), 5)), np.zeros((len(q), 3)), np.empty((len(q), 6))
    states = zip(q @ G.T, q, qd, qdd, instants(base, len(q)), strict=True)
    for i, (x, at, rate, accel, now) in enumerate(states):
        R, six = ground_axes(now.up), np.empty((2, 6))
        xd, xdd = np.zeros(7), np.zeros(7)
        xd[active], xdd[active] = rate, accel
        across = R @ np.array([[np.cos(at[0]), np.sin(at[0]), 0.0], [0.0, 0.0, 1.0]]).T  # (3, 2): the arm's plane
        for _ in range(20):
            _mujoco_move(data, R, now, (x, xd, xdd))
            mujoco.mj_fwdPosition(model, data)
            J = across.T @ gap_jacobian()[:, 6:]
            gap = across.T @ (data.site_xpos[halves[0]] - data.site_xpos[halves[1]])
            x[passive] -= np.linalg.solve(J[:, passive], gap)
        xd[passive] = -np.linalg.solve(J[:, passive], J[:, active] @ rate)
        _mujoco_move(data, R, now, (x, xd, xdd))
        mujoco.mj_inverse(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        for site, row in zip(halves, six, strict=True):
            mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_SITE, site, row, 0)
        xdd[passive] = -np.linalg.solve(J[:, passive], across.T @ (six[0, 3:] - six[1, 3:]))
        _mujoco_move(data, R, now, (x, xd, xdd))
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse.copy()
        f7 = np.linalg.solve(J[:, passive].T, needed[6:][passive])
        tau[i] = needed[6:][active] - J[:, active].T @ f7
        pin[i, 0], pin[i, 2] = f7
        needed[:3] = needed[:3] @ R
        needed[:6] -= *(now.acceleration + boom.gravity * now.up), *now.angular_acceleration
        mount[i] = -needed[:6]
    return ClosedLoads(tau, pin, mount)


def mujoco_mass_matrix(boom: Boom, q: Array) -> Array:
    """M(q) = G^T M_tree G, (n, 5, 5), at q (n, 5) by `mj_mulM`; the payload is a mass."""
    model, G = mujoco_model(boom), tree_matrix(boom)
    data, product, matrices = mujoco.MjData(model), np.empty(model.nv), np.empty((len(q), 5, 5))
    directions = np.concatenate([np.zeros((6, 5)), G]).T
    for M, x in zip(matrices, q @ G.T, strict=True):
        data.qpos[7:] = x
        mujoco.mj_fwdPosition(model, data)
        for column, direction in zip(M.T, directions, strict=True):
            mujoco.mj_mulM(model, data, product, direction)
            column[:] = directions @ product
    return matrices


def pinocchio_model(boom: Boom, *, payload_as: PayloadAs = "mass") -> pinocchio.Model:
    """The tree in Pinocchio, on a free-flyer; the last joint is the wrist."""
    still = pinocchio.SE3.Identity()
    model = pinocchio.Model()
    model.gravity.linear = -boom.gravity * UP
    joints = {"mount": model.addJoint(0, pinocchio.JointModelFreeFlyer(), still, "mount")}
    for link in tree(boom):
        joint = pinocchio.JointModelPZ() if link.slides else pinocchio.JointModelRZ()
        pose = pinocchio.SE3(link.rotation, np.array(link.position))
        joints[link.body] = model.addJoint(joints[link.parent], joint, pose, link.body)
        model.appendBodyToJoint(joints[link.body], _pinocchio_inertia(boom.bodies[link.body]), still)
    if payload_as == "mass":
        at_tip = pinocchio.SE3(np.eye(3), _tip_in_wrist(boom))
        model.appendBodyToJoint(joints["end_effector"], _pinocchio_inertia(boom.payload), at_tip)
    return model


def fixed_root(free: pinocchio.Model) -> pinocchio.Model:
    """The same tree without the free-flyer at its root."""
    model = pinocchio.Model()
    model.gravity = free.gravity
    for joint in range(2, free.njoints):
        model.addJoint(free.parents[joint] - 1, free.joints[joint], free.jointPlacements[joint], free.names[joint])
        model.appendBodyToJoint(joint - 1, free.inertias[joint], pinocchio.SE3.Identity())
    return model


def pinocchio_inverse_dynamics(
    boom: Boom,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    payload_as: PayloadAs = "mass",
    base: BaseMotion | None = None,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
) -> OracleLoads:
    """Joint torques and the wrench of the free root by `rnea` for states (n, 5)."""
    model = pinocchio_model(boom, payload_as=payload_as)
    data, wrist, tip = model.createData(), model.njoints - 1, _tip_in_wrist(boom)
    weight = -_hanging(boom, payload_as) * boom.gravity * UP
    given = [pinocchio.Force.Zero() for _ in range(model.njoints)]
    needed = np.empty((len(q), model.nv))
    forces, moments = (np.broadcast_to(x, (len(q), 3)) for x in (tip_force, tip_moment))
    outside = zip(instants(base, len(q)), forces, moments, strict=True)
    for row, (x, xd, xdd), (now, force, moment) in zip(needed, _tree_states(boom, q, qd, qdd), outside, strict=True):
        R = ground_axes(now.up)
        # A free-flyer's rates are along frame 1's axes; its linear one is the spatial acceleration,
        # a - w x v.
        root = now.acceleration - np.cross(now.angular_velocity, now.velocity)
        place = np.concatenate([pinocchio.SE3ToXYZQUAT(pinocchio.SE3(R, np.zeros(3))), x])
        rate = np.concatenate([now.velocity, now.angular_velocity, xd])
        accel = np.concatenate([root, now.angular_acceleration, xdd])
        pinocchio.forwardKinematics(model, data, place)
        into_wrist = data.oMi[wrist].rotation.T
        hung, push, twist = into_wrist @ weight, into_wrist @ R @ force, into_wrist @ R @ moment
        moment_there = np.cross(tip + boom.payload.com, hung) + np.cross(tip, push) + twist
        given[wrist] = pinocchio.Force(hung + push, moment_there)
        row[:] = pinocchio.rnea(model, data, place, rate, accel, given)
    return _closed(boom, needed)


def pinocchio_mass_matrix(boom: Boom, q: Array) -> Array:
    """M(q) = G^T M_tree G, (n, 5, 5), at q (n, 5) by `crba`; the payload is a mass."""
    model, G = pinocchio_model(boom), tree_matrix(boom)
    data, matrices = model.createData(), np.empty((len(q), 5, 5))
    place = pinocchio.neutral(model)
    for M, x in zip(matrices, q @ G.T, strict=True):
        place[7:] = x
        upper = np.triu(pinocchio.crba(model, data, place))
        M[:] = G.T @ (upper + np.triu(upper, 1).T)[6:, 6:] @ G
    return matrices


def pinocchio_energies(boom: Boom, q: Array, qd: Array, *, payload_as: PayloadAs = "mass") -> tuple[Array, Array]:
    """Kinetic and potential energy [J], each (n,), of states (n, 5); a payload that is a force has
    no kinetic one."""
    model = pinocchio_model(boom, payload_as=payload_as)
    data, place, rate = model.createData(), pinocchio.neutral(model), np.zeros(model.nv)
    energies = np.empty((len(q), 2))
    for row, (x, xd) in zip(energies, _tree_states(boom, q, qd), strict=True):
        place[7:], rate[6:] = x, xd
        row[:] = (
            pinocchio.computeKineticEnergy(model, data, place, rate),
            pinocchio.computePotentialEnergy(model, data, place),
        )
        payload = data.oMi[model.njoints - 1].act(_tip_in_wrist(boom) + boom.payload.com)
        row[1] += _hanging(boom, payload_as) * boom.gravity * payload[2]
    kinetic, potential = energies.T
    return kinetic, potential


class TextbookFrame(NamedTuple):
    """Motion of a frame, each (3,) along its own axes; `vd` holds gravity as an upward acceleration
    of frame 1."""

    w: Array
    wd: Array
    v: Array
    vd: Array


class Need(NamedTuple):
    """Force through a point and moment that a body's motion needs, each (3,) in frame 1."""

    point: Array
    force: Array
    moment: Array


def textbook_recursion(
    boom: Boom, q: Array, qd: Array, qdd: Array, loop: Loop, base: BaseMotion | None = None
) -> list[TextbookFrame]:
    """Return frames 1 to 11 of one loop for one state (5,).

    By eqs. 2.39-2.43 of the thesis as corrected.
    """
    poses = frame_transforms(boom, q, loop)
    # d and theta of the DH rows are linear in q
    rate, accel = (dh_rows(boom, x, loop)[:, 2:] - dh_rows(boom, np.zeros(5), loop)[:, 2:] for x in (qd, qdd))
    now = BaseMotion.of() if base is None else base
    start = (now.angular_velocity, now.angular_acceleration, now.velocity, now.acceleration + boom.gravity * now.up)
    motions = [TextbookFrame(*start)]
    for i in range(10):
        w, wd, v, vd = motions[i]
        R_parent = poses[i, :3, :3]
        R = poses[i + 1, :3, :3].T @ R_parent
        P = R_parent.T @ (poses[i + 1, :3, 3] - poses[i, :3, 3])
        d_rate, theta_rate = rate[i, :, None] * UP
        d_accel, theta_accel = accel[i, :, None] * UP
        w_next = R @ w + theta_rate
        motions.append(
            TextbookFrame(
                w=w_next,
                wd=R @ wd + np.cross(R @ w, theta_rate) + theta_accel,
                v=R @ (np.cross(w, P) + v) + d_rate,
                vd=R @ (np.cross(wd, P) + np.cross(w, np.cross(w, P)) + vd) + 2 * np.cross(w_next, d_rate) + d_accel,
            )
        )
    return motions


def textbook_needs(
    boom: Boom,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    payload_as: PayloadAs = "mass",
    base: BaseMotion | None = None,
    tip_force: ArrayLike = (0.0, 0.0, 0.0),
    tip_moment: ArrayLike = (0.0, 0.0, 0.0),
) -> dict[str, Need]:
    """What every body, the payload and the "tip" (what is not put on it) need in one state (5,), by
    eqs. 2.44-2.46."""
    loops: tuple[Loop, Loop] = ("inner", "outer")
    motions = {loop: textbook_recursion(boom, q, qd, qdd, loop, base) for loop in loops}
    poses = _placed(boom, q)
    needs = {}
    for name, (loop, frame) in {**BODY_FRAMES, "payload": ("outer", 11)}.items():
        body = {**boom.bodies, "payload": boom.payload}[name]
        w, wd, _, vd = motions[loop][frame - 1]
        R, origin = poses[name][:3, :3], poses[name][:3, 3]
        com_accel = np.cross(wd, body.com) + np.cross(w, np.cross(w, body.com)) + vd
        moment = body.inertia @ wd + np.cross(w, body.inertia @ w)
        needs[name] = Need(origin + R @ body.com, body.mass * R @ com_accel, R @ moment)
    if payload_as == "force":
        up = UP if base is None else base.up
        needs["payload"] = Need(needs["payload"].point, boom.payload.mass * boom.gravity * up, np.zeros(3))
    return needs | {"tip": Need(poses["tip"][:3, 3], -np.asarray(tip_force), -np.asarray(tip_moment))}


def virtual_work(boom: Boom, q: Array, needs: Mapping[str, Need]) -> Array:
    """Return tau_i = sum over bodies of F . dc/dq_i + N . domega/dqd_i, (5,), at q (5,).

    The derivatives are differences of the poses.
    """
    point, force, moment = (np.array(part) for part in zip(*needs.values(), strict=True))

    def poses(at: Array) -> Array:
        placed = _placed(boom, at)
        return np.stack([placed[name] for name in needs])

    T = poses(q)
    tau = np.empty(5)
    for i, direction in enumerate(np.eye(5)):
        dT = derivative(lambda s, direction=direction: poses(q + s * direction))
        turn = turning(T[:, :3, :3], dT[:, :3, :3])
        shift = dT[:, :3, 3] + np.cross(turn, point - T[:, :3, 3])
        tau[i] = np.sum(force * shift + moment * turn)
    return tau


def generic(boom: Boom) -> Boom:
    """The boom with nothing left out or symmetric.

    Full inertia tensors, centres of mass out of the arm's plane, a payload with both, friction and
    a drive on every joint.
    """
    rng = np.random.default_rng(1)

    def skewed(body: Body) -> Body:
        points = rng.normal(scale=0.2, size=(4, 3))
        inertia = body.mass / 4 * (np.sum(points**2) * np.eye(3) - points.T @ points)
        return Body(body.mass, body.com + rng.uniform(-0.1, 0.1, 3), inertia)

    drive = next(drive for drive in boom.drives if drive is not None)
    drives = tuple(replace(drive, gearbox=replace(drive.gearbox, ratio=ratio)) for ratio in (50.0, 80.0, 100.0, 120.0, 160.0))
    viscous, coulomb = rng.uniform(1.0, 20.0, (2, 5))
    return replace(
        boom,
        bodies={name: skewed(body) for name, body in boom.bodies.items()},
        payload=skewed(boom.payload),
        friction=Friction(viscous, coulomb, (None,) * 5),
        drives=drives,
    )


BOOMS = {"third generation": Boom.load(), "generic": generic(Boom.load())}
"""The shipped boom, whose payload is a point, and one with nothing left out or symmetric."""


def random_states(boom: Boom, count: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """q, qd, qdd, each (count, 5): q within the limits, qd up to twice its limits, qdd up to 2 in
    SI."""
    limits = boom.limits
    q = rng.uniform(limits.lower, limits.upper, (count, 5))
    q[:, 2] = rng.uniform(q[:, 1] + limits.linkage, limits.upper[2])
    return q, rng.uniform(-2, 2, (count, 5)) * limits.velocity, rng.uniform(-2, 2, (count, 5))


def random_base(rng: np.random.Generator, *shape: int) -> BaseMotion:
    """A base motion with entries (*shape, 3): any tilt, up to 5 in SI along each axis
    of frame 1."""
    return BaseMotion.of(
        velocity=rng.uniform(-3.0, 3.0, (*shape, 3)),
        angular_velocity=rng.uniform(-1.5, 1.5, (*shape, 3)),
        acceleration=rng.uniform(-5.0, 5.0, (*shape, 3)),
        angular_acceleration=rng.uniform(-2.0, 2.0, (*shape, 3)),
        up=rng.normal(size=(*shape, 3)),
    )


def instants(base: BaseMotion | None, count: int) -> list[BaseMotion]:
    """The base motion of each of `count` samples, entries (3,)."""
    base = BaseMotion.of() if base is None else base
    series = (np.broadcast_to(getattr(base, field.name), (count, 3)) for field in fields(base))
    return [BaseMotion(*now) for now in zip(*series, strict=True)]


def ground_axes(up: Array) -> Array:
    """A rotation R_ground_1 (3, 3) that makes `up` the ground's z axis; the heading is anything."""
    x = np.cross(up, [0.6, -0.7, 0.4])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def derivative(f: Callable[[float], ArrayLike], h: float = 1e-2) -> Array:
    """df/ds at s = 0 by the central difference of sixth order."""
    weights = ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
    slope: Array = np.sum([w * (np.asarray(f(k * h)) - np.asarray(f(-k * h))) for k, w in weights], axis=0) / h
    return slope


def errors(actual: Array, expected: Array) -> Array:
    """Of each column, relative to its largest entry."""
    error: Array = np.abs(actual - expected).max(axis=0) / np.abs(expected).max(axis=0)
    return error


def turning(R: Array, dR: Array) -> Array:
    """omega (..., 3) of dR = [omega x] R."""
    S = dR @ np.swapaxes(R, -1, -2)
    S = (S - np.swapaxes(S, -1, -2)) / 2
    return np.stack([S[..., 2, 1], S[..., 0, 2], S[..., 1, 0]], axis=-1)


def _tree_states(boom: Boom, *states: Array) -> list[tuple[Array, ...]]:
    """The tree's coordinates, rates, ... (7,) each, state by state."""
    G = tree_matrix(boom)
    return list(zip(*(x @ G.T for x in states), strict=True))


def _mujoco_move(data: mujoco.MjData, R: Array, base: BaseMotion, state: tuple[Array, ...]) -> None:
    """A free joint's linear rates are along the world's axes, its angular ones along the body's."""
    mujoco.mju_mat2Quat(data.qpos[3:7], R.ravel())
    data.qvel[:6] = *(R @ base.velocity), *base.angular_velocity
    data.qacc[:6] = *(R @ base.acceleration), *base.angular_acceleration
    data.qpos[7:], data.qvel[6:], data.qacc[6:] = state


def _closed(boom: Boom, needed: Array) -> OracleLoads:
    return OracleLoads(needed[:, 6:] @ tree_matrix(boom), -needed[:, :6])


def _placed(boom: Boom, q: Array) -> dict[str, Array]:
    poses = body_transforms(boom, q)
    return poses | {"payload": poses["tip"]}


def _pinocchio_inertia(body: Body) -> pinocchio.Inertia:
    return pinocchio.Inertia(body.mass, body.com, body.inertia)


def _hanging(boom: Boom, payload_as: PayloadAs) -> float:
    return boom.payload.mass if payload_as == "force" else 0.0


def _tip_in_wrist(boom: Boom) -> Array:
    return np.array([boom.geometry.L8, 0.0, 0.0])


def _rigid(element: ElementTree.Element, body: Body) -> None:
    # MuJoCo diagonalises a full tensor, and wants it positive
    full = {"fullinertia": body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]}
    _inertial(element, body.mass, body.com, **(full if body.inertia.any() else {"diaginertia": np.zeros(3)}))


def _inertial(body: ElementTree.Element, mass: float, com: ArrayLike = (0, 0, 0), **inertia: ArrayLike) -> None:
    numbers = {"pos": com, "mass": mass, **inertia}
    ElementTree.SubElement(body, "inertial", {name: _text(values) for name, values in numbers.items()})


def _text(numbers: ArrayLike) -> str:
    return " ".join(repr(float(x)) for x in np.ravel(numbers))
