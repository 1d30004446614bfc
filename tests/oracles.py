"""Independent models of the boom that tests hold `boom_model` against: MuJoCo, Pinocchio and the textbook recursion.

MuJoCo and Pinocchio get an open tree with a joint for every link of the linkage, rooted in a body that is frame 1. The
parallelogram makes the tree's coordinates linear in the boom's: x = G q, and so the closed linkage needs
tau = G^T tau_tree. The textbook form takes the frames of the DH tables through eqs. 2.39-2.46 of the thesis (as
corrected), one state at a time, and turns forces into torques by virtual work.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio
from numpy.typing import ArrayLike

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.dynamics import PayloadAs
from boom_model.frames import BODY_FRAMES, Loop, body_transforms, dh_rows, frame_transforms

UP = np.array([0.0, 0.0, 1.0])


class TreeLink(NamedTuple):
    """A body of the tree, on a joint along its own z axis; its frame is the one of `BODY_FRAMES`."""

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
    mount: Array | None
    """(n, 6) force and moment of the boom on the mount, in and about frame 1; None on a fixed root."""


def tree(boom: Boom) -> list[TreeLink]:
    """The boom cut open at pin 7: base, then lower and outer, then inner and all that hangs on it, depth first."""
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


def mujoco_model(boom: Boom, *, payload_as: PayloadAs = "mass", free_root: bool = False) -> mujoco.MjModel:
    """The tree in MuJoCo, with sites at the tip and at either half of pin 7.

    MuJoCo wants mass on a free root: it gets 1e-9 kg, and no gravity.
    """
    g = boom.geometry
    top = ElementTree.Element("mujoco")
    ElementTree.SubElement(top, "compiler", angle="radian")
    option = ElementTree.SubElement(top, "option", gravity=_text(-boom.gravity * UP))
    ElementTree.SubElement(option, "flag", contact="disable", constraint="disable")
    world = ElementTree.SubElement(top, "worldbody")
    bodies = {"mount": ElementTree.SubElement(world, "body", name="mount", gravcomp="1")}
    if free_root:
        ElementTree.SubElement(bodies["mount"], "freejoint")
        _inertial(bodies["mount"], mass=1e-9, diaginertia=[1e-9, 1e-9, 1e-9])
    for link in tree(boom):
        body, pose = boom.bodies[link.body], {"pos": _text(link.position), "xyaxes": _text(link.axes)}
        element = ElementTree.SubElement(bodies[link.parent], "body", pose, name=link.body)
        ElementTree.SubElement(element, "joint", type="slide" if link.slides else "hinge", axis="0 0 1")
        _inertial(element, body.mass, body.com, fullinertia=body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        bodies[link.body] = element
    payload = ElementTree.SubElement(bodies["end_effector"], "body", name="payload", pos=_text([g.L8, 0.0, 0.0]))
    if payload_as == "mass":
        _inertial(payload, boom.payload.mass, diaginertia=[0.0, 0.0, 0.0])
    ElementTree.SubElement(payload, "site", name="tip")
    ElementTree.SubElement(bodies["outer"], "site", name="pin 7 of outer", pos=_text([g.L4, 0.0, 0.0]))
    ElementTree.SubElement(bodies["upper"], "site", name="pin 7 of upper", pos=_text([0.0, g.L5, 0.0]))
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(top, encoding="unicode"))


def mujoco_kinematics(boom: Boom, q: Array) -> mujoco.MjData:
    """Bodies and sites placed at q (5,)."""
    model = mujoco_model(boom)
    data = mujoco.MjData(model)
    data.qpos[:] = tree_matrix(boom) @ q
    mujoco.mj_kinematics(model, data)
    return data


def mujoco_inverse_dynamics(
    boom: Boom, q: Array, qd: Array, qdd: Array, *, payload_as: PayloadAs = "mass", free_root: bool = False
) -> OracleLoads:
    """Joint torques by `mj_inverse` for states (n, 5); on a free root, held at rest, the mount's wrench too."""
    model = mujoco_model(boom, payload_as=payload_as, free_root=free_root)
    data = mujoco.MjData(model)
    G, weight = tree_matrix(boom), -_hanging(boom, payload_as) * boom.gravity * UP
    J = np.empty((3, model.nv))
    needed = np.empty((len(q), model.nv))
    for row, *state in zip(needed, q, qd, qdd, strict=True):
        data.qpos[-7:], data.qvel[-7:], data.qacc[-7:] = (G @ x for x in state)
        mujoco.mj_inverse(model, data)
        mujoco.mj_jacSite(model, data, J, None, model.site("tip").id)
        row[:] = data.qfrc_inverse - weight @ J
    return _closed(needed, G)


def pinocchio_model(boom: Boom, *, payload_as: PayloadAs = "mass", free_root: bool = False) -> pinocchio.Model:
    """The tree in Pinocchio; the last joint is the wrist."""
    still = pinocchio.SE3.Identity()
    model = pinocchio.Model()
    model.gravity.linear = -boom.gravity * UP
    joints = {"mount": model.addJoint(0, pinocchio.JointModelFreeFlyer(), still, "mount") if free_root else 0}
    for link in tree(boom):
        joint = pinocchio.JointModelPZ() if link.slides else pinocchio.JointModelRZ()
        pose, body = pinocchio.SE3(link.rotation, np.array(link.position)), boom.bodies[link.body]
        joints[link.body] = model.addJoint(joints[link.parent], joint, pose, link.body)
        model.appendBodyToJoint(joints[link.body], pinocchio.Inertia(body.mass, body.com, body.inertia), still)
    if payload_as == "mass":
        payload = pinocchio.Inertia(boom.payload.mass, _tip_in_wrist(boom), np.zeros((3, 3)))
        model.appendBodyToJoint(joints["end_effector"], payload, still)
    return model


def pinocchio_inverse_dynamics(
    boom: Boom, q: Array, qd: Array, qdd: Array, *, payload_as: PayloadAs = "mass", free_root: bool = False
) -> OracleLoads:
    """Joint torques by `rnea` for states (n, 5); on a free root, held at rest, the mount's wrench too."""
    model = pinocchio_model(boom, payload_as=payload_as, free_root=free_root)
    data, wrist = model.createData(), model.njoints - 1
    G, weight = tree_matrix(boom), -_hanging(boom, payload_as) * boom.gravity * UP
    x, xd, xdd = pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    outside = [pinocchio.Force.Zero() for _ in range(model.njoints)]
    needed = np.empty((len(q), model.nv))
    for row, *state in zip(needed, q, qd, qdd, strict=True):
        x[-7:], xd[-7:], xdd[-7:] = (G @ y for y in state)
        pinocchio.forwardKinematics(model, data, x)
        force = data.oMi[wrist].rotation.T @ weight
        outside[wrist] = pinocchio.Force(force, np.cross(_tip_in_wrist(boom), force))
        row[:] = pinocchio.rnea(model, data, x, xd, xdd, outside)
    return _closed(needed, G)


def pinocchio_mass_matrix(boom: Boom, q: Array) -> Array:
    """M(q) = G^T M_tree G, (5, 5), at q (5,) by `crba`; the payload is a mass."""
    model, G = pinocchio_model(boom), tree_matrix(boom)
    upper = np.triu(pinocchio.crba(model, model.createData(), G @ q))
    return G.T @ (upper + np.triu(upper, 1).T) @ G


def pinocchio_energy(boom: Boom, q: Array, qd: Array, *, payload_as: PayloadAs = "mass") -> float:
    """Kinetic and potential energy [J] at one state (5,); a payload that is a force has potential energy alone."""
    model, G = pinocchio_model(boom, payload_as=payload_as), tree_matrix(boom)
    data = model.createData()
    energy = pinocchio.computeMechanicalEnergy(model, data, G @ q, G @ qd)
    tip = data.oMi[model.njoints - 1].act(_tip_in_wrist(boom))
    return float(energy + _hanging(boom, payload_as) * boom.gravity * tip[2])


class FrameMotion(NamedTuple):
    """Motion of a frame, each (3,) along its own axes; `vd` holds gravity as an upward acceleration of frame 1."""

    w: Array
    wd: Array
    v: Array
    vd: Array


class Need(NamedTuple):
    """Force through a point and moment that a body's motion needs, each (3,) in frame 1."""

    point: Array
    force: Array
    moment: Array


def textbook_recursion(boom: Boom, q: Array, qd: Array, qdd: Array, loop: Loop) -> list[FrameMotion]:
    """Frames 1 to 11 of one loop by eqs. 2.39-2.43 of the thesis as corrected, for one state (5,)."""
    poses = frame_transforms(boom, q, loop)
    # d and theta of the DH rows are linear in q
    rate, accel = (dh_rows(boom, x, loop)[:, 2:] - dh_rows(boom, np.zeros(5), loop)[:, 2:] for x in (qd, qdd))
    motions = [FrameMotion(np.zeros(3), np.zeros(3), np.zeros(3), boom.gravity * UP)]
    for i in range(10):
        w, wd, v, vd = motions[i]
        R_parent = poses[i, :3, :3]
        R = poses[i + 1, :3, :3].T @ R_parent
        P = R_parent.T @ (poses[i + 1, :3, 3] - poses[i, :3, 3])
        d_rate, theta_rate = rate[i, :, None] * UP
        d_accel, theta_accel = accel[i, :, None] * UP
        w_next = R @ w + theta_rate
        motions.append(
            FrameMotion(
                w=w_next,
                wd=R @ wd + np.cross(R @ w, theta_rate) + theta_accel,
                v=R @ (np.cross(w, P) + v) + d_rate,
                vd=R @ (np.cross(wd, P) + np.cross(w, np.cross(w, P)) + vd) + 2 * np.cross(w_next, d_rate) + d_accel,
            )
        )
    return motions


def textbook_needs(boom: Boom, q: Array, qd: Array, qdd: Array, *, payload_as: PayloadAs = "mass") -> dict[str, Need]:
    """What every body needs in one state (5,), and the payload as "tip", by eqs. 2.44-2.46 of the thesis."""
    loops: tuple[Loop, Loop] = ("inner", "outer")
    motions = {loop: textbook_recursion(boom, q, qd, qdd, loop) for loop in loops}
    poses = body_transforms(boom, q)
    needs = {}
    for name, (loop, frame) in BODY_FRAMES.items():
        body, (w, wd, _, vd) = boom.bodies[name], motions[loop][frame - 1]
        R, origin = poses[name][:3, :3], poses[name][:3, 3]
        com_accel = np.cross(wd, body.com) + np.cross(w, np.cross(w, body.com)) + vd
        moment = body.inertia @ wd + np.cross(w, body.inertia @ w)
        needs[name] = Need(origin + R @ body.com, body.mass * R @ com_accel, R @ moment)
    R, origin = poses["tip"][:3, :3], poses["tip"][:3, 3]
    tip_accel = R @ motions["outer"][10].vd if payload_as == "mass" else boom.gravity * UP
    return needs | {"tip": Need(origin, boom.payload.mass * tip_accel, np.zeros(3))}


def virtual_work(boom: Boom, q: Array, needs: Mapping[str, Need]) -> Array:
    """tau_i = sum over bodies of F . dc/dq_i + N . domega/dqd_i, (5,), at q (5,), by differences of the poses."""
    point, force, moment = (np.array(part) for part in zip(*needs.values(), strict=True))

    def poses(at: Array) -> Array:
        placed = body_transforms(boom, at)
        return np.stack([placed[name] for name in needs])

    T = poses(q)
    tau = np.empty(5)
    for i, direction in enumerate(np.eye(5)):
        dT = derivative(lambda s, direction=direction: poses(q + s * direction))
        turn = turning(T[:, :3, :3], dT[:, :3, :3])
        shift = dT[:, :3, 3] + np.cross(turn, point - T[:, :3, 3])
        tau[i] = np.sum(force * shift + moment * turn)
    return tau


def random_states(boom: Boom, count: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """q, qd, qdd, each (count, 5): q within the limits, qd up to twice its limits, qdd up to 2 in SI."""
    limits = boom.limits
    q = rng.uniform(limits.lower, limits.upper, (count, 5))
    q[:, 2] = rng.uniform(q[:, 1] + limits.linkage, limits.upper[2])
    return q, rng.uniform(-2, 2, (count, 5)) * limits.velocity, rng.uniform(-2, 2, (count, 5))


def derivative(f: Callable[[float], ArrayLike], h: float = 1e-2) -> Array:
    """df/ds at s = 0 by the central difference of sixth order."""
    weights = ((1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
    slope: Array = np.sum([w * (np.asarray(f(k * h)) - np.asarray(f(-k * h))) for k, w in weights], axis=0) / h
    return slope


def turning(R: Array, dR: Array) -> Array:
    """omega (..., 3) of dR = [omega x] R."""
    S = dR @ np.swapaxes(R, -1, -2)
    S = (S - np.swapaxes(S, -1, -2)) / 2
    return np.stack([S[..., 2, 1], S[..., 0, 2], S[..., 1, 0]], axis=-1)


def _closed(needed: Array, G: Array) -> OracleLoads:
    root = needed[:, :-7]
    return OracleLoads(needed[:, -7:] @ G, -root if root.size else None)


def _hanging(boom: Boom, payload_as: PayloadAs) -> float:
    return boom.payload.mass if payload_as == "force" else 0.0


def _tip_in_wrist(boom: Boom) -> Array:
    return np.array([boom.geometry.L8, 0.0, 0.0])


def _inertial(body: ElementTree.Element, mass: float, com: ArrayLike = (0, 0, 0), **inertia: ArrayLike) -> None:
    numbers = {"pos": com, "mass": mass, **inertia}
    ElementTree.SubElement(body, "inertial", {name: _text(values) for name, values in numbers.items()})


def _text(numbers: ArrayLike) -> str:
    return " ".join(repr(float(x)) for x in np.ravel(numbers))
