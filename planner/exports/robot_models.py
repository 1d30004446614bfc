"""Models of the boom for other tools: URDF, and MJCF for MuJoCo.

Links have the frames of the DH tables (`boom_model.kinematics.frames.BODY_FRAMES`). Every joint
turns about or slides along its own z axis. The five joints keep their names and coordinates.

MJCF has the linkage as a loop, cut open at pin 7 and closed again by a `connect` constraint:

    mount -yaw- base -lower- lower -pin 6- outer
                base -inner- inner -pin 8- upper -extension- extension -wrist- end_effector - tip

URDF allows trees only. There the loop is cut at pin 8. Two massless links, level_6 and level_7,
stay parallel to the base. Thus each of the pins 6 and 7 consists of two joints, each of which
follows a single joint:

    mount -yaw- base -inner- inner
                base -lower- lower -pin 6- outer -pin 7- upper
                upper -extension- extension -wrist- end_effector - tip

Let G be the matrix of the <mimic> multipliers, so that the tree's coordinates are x = G q. The
joint torques of the linkage are tau = G^T tau_tree: a torque that a tool computes for a mimic joint
belongs to the joint that it mimics.

The solids along the links are for display only; their thickness is not that of the boom.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import ArrayLike

from boom_model import JOINTS, Body, Boom, InputError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from boom_model.drives.drive import drive_torque_limit
from boom_model.kinematics.frames import R_LINK_BODY
from planner.files import replacing
from planner.reports.report import assumptions

UNLIMITED_EFFORT = 1e6
"""Effort limit [Nm, N for the extension] of a joint without a drive. URDF requires a limit."""

FORMS = (".urdf", ".xml")

_STEEL = 7850.0  # [kg/m^3], density of the ball that is drawn for the payload
_DRAWN = "The solids are for display and not measured. Masses, centres of mass and inertias are those of the boom."
_COLORS = {
    "base": (0.60, 0.60, 0.60),
    "lower": (0.94, 0.89, 0.26),
    "inner": (0.34, 0.71, 0.91),
    "outer": (0.00, 0.62, 0.45),
    "upper": (0.90, 0.62, 0.00),
    "extension": (0.00, 0.45, 0.70),
    "end_effector": (0.80, 0.47, 0.65),
    "tip": (0.90, 0.90, 0.90),
}


def write_model(boom: Boom, path: str | Path) -> None:
    """Write the boom as URDF (a name that ends in .urdf) or MJCF (.xml).

    Raises:
        InputError: the name has another ending, the file cannot be written, or as `urdf` or `mjcf`.
    """
    form = Path(path).suffix.lower()
    if form not in FORMS:
        raise InputError(f"{path}: the name of a boom's model must end in .urdf, or in .xml for MuJoCo")
    text = urdf(boom) if form == ".urdf" else mjcf(boom)
    with replacing(path) as temporary:
        Path(temporary).write_text(text, encoding="utf-8")


def urdf(boom: Boom) -> str:
    """Return the boom as URDF, a tree in which mimic joints represent the parallelogram.

    Position and velocity limits are those of the boom. An effort limit is the torque that the drive
    allows at rest with its margin, or UNLIMITED_EFFORT without a drive. Each of the five joints has
    a transmission, so Drake and ros_control treat it as an actuator. Its ratio is 1, because
    efforts are joint torques. URDF cannot represent the coupled limit of lower - inner or the
    reflected inertia of the drives.

    Raises:
        InputError: the linkage has unequal links, which no mimic joint can represent.
    """
    boom.geometry.require_parallelogram("a URDF")
    top = Element("robot", name=boom.name)
    for text in (
        "URDF cannot close a loop. The linkage is cut open at pin 8, between the inner and the upper link. The massless "
        "links level_6 and level_7 stay parallel to the base, because the joints at pins 6 and 7 mimic lower and inner.",
        "A torque that a tool computes for a mimic joint belongs to the joint it mimics: add it there, times the multiplier.",
        f"URDF cannot represent the coupled limit: lower - inner is at least {boom.limits.linkage:.6g} rad.",
        f"An effort of {UNLIMITED_EFFORT:.0f} means that the joint has no drive.",
        *_remarks(boom),
    ):
        top.append(ElementTree.Comment(f" {text} "))
    for name, color in _COLORS.items():
        SubElement(SubElement(top, "material", name=name), "color", rgba=_text((*color, 1.0)))
    SubElement(top, "link", name="mount")
    for link in _tree(boom):
        _urdf_link(top, boom, link.name)
        _urdf_joint(top, boom, link)
    for joint in JOINTS:
        _urdf_transmission(top, joint)
    return _document(top)


def mjcf(boom: Boom) -> str:
    """Return the boom as MJCF, with its loop closed at pin 7 by a `connect` constraint.

    Each joint has a motor, whose control is the joint torque [Nm, N for the extension]. If the
    joint has a drive, the control is limited to what the drive allows at rest with its margin, and
    the armature is the drive's reflected inertia. Named poses are keyframes, with their static
    torques as controls.

    The parallelogram has a second, crossed configuration, which it can enter where it is flat. The
    coupled limit prevents this at lower = inner. Nothing prevents it at lower - inner = 180 deg.

    Raises:
        InputError: the linkage has unequal links, or a moving body has no mass or no inertia, which
            MuJoCo cannot simulate.
    """
    boom.geometry.require_parallelogram("an MJCF")
    for name, body in boom.bodies.items():
        if not (body.mass > 0.0 and np.linalg.eigvalsh(body.inertia)[0] > 0.0):
            raise InputError(f"{name} has no mass, or no inertia about some axis; MuJoCo needs both to be above 0")
    top = Element("mujoco", model=boom.name)
    for text in (
        "The connect constraint closes the parallelogram at pin 7. Start from a keyframe: with all joints at 0 it is flat.",
        "A motor's control is the joint torque. The armature of a joint is its drive's reflected inertia, if that is known.",
        *_remarks(boom),
    ):
        top.append(ElementTree.Comment(f" {text} "))
    SubElement(top, "compiler", angle="radian", autolimits="true")
    SubElement(top, "option", gravity=_text((0.0, 0.0, -boom.gravity)), timestep="0.001", integrator="implicitfast")
    world = SubElement(top, "worldbody")
    SubElement(world, "light", pos="0 0 4", dir="0 0 -1", directional="true")
    bodies = {"mount": SubElement(world, "body", name="mount")}
    for link in _linkage(boom):
        pose = {"pos": _text(link.position), "xyaxes": _text(link.rotation[:, :2].T)}
        bodies[link.name] = SubElement(bodies[link.parent], "body", pose, name=link.name)
        _mjcf_body(bodies[link.name], boom, link)
    equality = SubElement(top, "equality")
    # The stiffest constraint in MuJoCo: it lets through 1e-4 of the acceleration that it prevents.
    stiff = {"solref": "0.002 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
    # Bodies and an anchor, because Drake ignores sites. The anchor is in the frame of body1. MuJoCo
    # finds its position in body2 with all joints at 0, where the loop is closed.
    pin = {"body1": "outer", "body2": "upper", "anchor": _text((boom.geometry.L4, 0.0, 0.0))}
    SubElement(equality, "connect", {**pin, **stiff}, name="pin_7")
    actuators = SubElement(top, "actuator")
    for i, joint in enumerate(JOINTS):
        limit = _effort(boom, i)
        limits = {} if limit is None else {"ctrlrange": _text((-limit, limit))}
        SubElement(actuators, "motor", limits, name=joint, joint=joint)
    keys = SubElement(top, "keyframe")
    G = np.array([link.row for link in _linkage(boom) if link.row is not None])
    for name, q in boom.poses.items():
        hold = inverse_dynamics(boom, q, np.zeros(5), np.zeros(5), reactions=False).tau
        SubElement(keys, "key", name=name, qpos=_text(G @ q), ctrl=_text(hold))
    return _document(top)


def left_out(boom: Boom) -> tuple[str, ...]:
    """Return what was measured on the boom and neither format can represent."""
    sizes = [
        f"{joint} {size:.4g} {unit}"
        for joint, size, unit in zip(JOINTS, boom.friction.asymmetric, LOAD_UNITS, strict=True)
        if size != 0.0
    ]
    found = []
    if sizes:
        found.append(
            "dry friction is the same in both directions; the asymmetric part is left out, to be added to the torque of a "
            f"joint that moves: {', '.join(sizes)}"
        )
    if boom.calibration is not None:
        found.append("joint coordinates are true positions; offsets and scale of the readings are left out")
    return tuple(found)


def _remarks(boom: Boom) -> list[str]:
    assumed = [f"Assumed: {sentence}".replace("--", "- -") for sentence in assumptions(boom, jerk_limited=False)]
    return [_DRAWN, *left_out(boom), *assumed]


# The tree


def _axes(x: tuple[int, int, int], y: tuple[int, int, int]) -> Array:
    axes = np.array([x, y, np.cross(x, y)], dtype=float)
    return axes.T


_HERE = (0.0, 0.0, 0.0)
_PARALLEL, _RAISED, _ACROSS = np.eye(3), _axes((1, 0, 0), (0, 0, 1)), _axes((0, -1, 0), (1, 0, 0))


@dataclass(frozen=True, eq=False)
class _Link:
    """Link, and the joint along its z axis that connects it to its parent."""

    name: str
    parent: str
    position: tuple[float, float, float]
    """Position of the link's frame in its parent's [m], with the joint's coordinate at 0."""
    rotation: Array
    """Rotation (3, 3) of the link's frame in its parent's, with the joint's coordinate at 0."""
    joint: str
    row: tuple[float, ...] | None
    """The joint's coordinate is row . q; None for a fixed joint."""


def _linkage(boom: Boom) -> list[_Link]:
    """Return the links of the linkage cut open at pin 7, parents before children."""
    g = boom.geometry
    shoulder = (g.L2, 0.0, g.L1)
    return [
        _Link("base", "mount", _HERE, _PARALLEL, "yaw", (1, 0, 0, 0, 0)),
        _Link("lower", "base", shoulder, _RAISED, "lower", (0, 0, 1, 0, 0)),
        _Link("outer", "lower", (g.L3, 0.0, 0.0), _PARALLEL, "outer", (0, 1, -1, 0, 0)),
        _Link("inner", "base", shoulder, _RAISED, "inner", (0, 1, 0, 0, 0)),
        _Link("upper", "inner", (g.L9, 0.0, 0.0), _ACROSS, "upper", (0, -1, 1, 0, 0)),
        *_actuator(boom),
    ]


def _tree(boom: Boom) -> list[_Link]:
    """Return the links of the linkage cut open at pin 8, parents before children.

    Pinocchio's parser traverses depth first, by name, and needs a joint before those that mimic it.
    It meets inner and lower before the rest.
    """
    g = boom.geometry
    shoulder = (g.L2, 0.0, g.L1)
    return [
        _Link("base", "mount", _HERE, _PARALLEL, "yaw", (1, 0, 0, 0, 0)),
        _Link("inner", "base", shoulder, _RAISED, "inner", (0, 1, 0, 0, 0)),
        _Link("lower", "base", shoulder, _RAISED, "lower", (0, 0, 1, 0, 0)),
        _Link("level_6", "lower", (g.L3, 0.0, 0.0), _PARALLEL, "lower_to_level", (0, 0, -1, 0, 0)),
        _Link("outer", "level_6", _HERE, _PARALLEL, "level_to_outer", (0, 1, 0, 0, 0)),
        _Link("level_7", "outer", (g.L4, 0.0, 0.0), _PARALLEL, "outer_to_level", (0, -1, 0, 0, 0)),
        _Link("pin_7", "level_7", _HERE, _ACROSS, "level_to_upper", (0, 0, 1, 0, 0)),
        _Link("upper", "pin_7", (0.0, -g.L5, 0.0), _PARALLEL, "upper_fixed", None),
        *_actuator(boom),
    ]


def _actuator(boom: Boom) -> list[_Link]:
    g = boom.geometry
    return [
        _Link("extension", "upper", (g.L6, -g.L7, 0.0), _axes((-1, 0, 0), (0, 0, -1)), "extension", (0, 0, 0, 1, 0)),
        _Link("end_effector", "extension", _HERE, _RAISED, "wrist", (0, 0, 0, 0, 1)),
        _Link("tip", "end_effector", (g.L8, 0.0, 0.0), _PARALLEL, "tip_fixed", None),
    ]


def _body(boom: Boom, link: str) -> Body | None:
    return boom.payload if link == "tip" else boom.bodies.get(link)


def _range(boom: Boom, row: tuple[float, ...]) -> tuple[float, float]:
    """Return the range of the coordinate row . q within the position and coupled limits."""
    ends = np.array(row) * np.stack([boom.limits.lower, boom.limits.upper])
    low, high = float(ends.min(axis=0).sum()), float(ends.max(axis=0).sum())
    if row[1] * row[2] < 0.0:  # between the two link directions
        gap = boom.limits.linkage
        return (max(low, gap), high) if row[2] > 0.0 else (low, min(high, -gap))
    return low, high


def _effort(boom: Boom, joint: int) -> float | None:
    drive = boom.drives[joint]
    limit = None if drive is None else drive_torque_limit(drive, 0.0)
    return None if limit is None else float(limit)


# The solids


@dataclass(frozen=True, eq=False)
class _Rod:
    """Solid cylinder between two points of a link's frame [m]."""

    ends: Array
    """(2, 3)."""
    radius: float


def _rods(boom: Boom) -> Mapping[str, list[_Rod]]:
    """Return the rods that are drawn for each body, from pin to pin along its link axes (e, p).

    The upper link carries the actuator's housing.
    """
    g = boom.geometry
    stroke = float(boom.limits.upper[3])
    rod = max(g.L7, stroke)
    lines = {
        "base": [((0.0, 0.0), (0.0, g.L1), 0.08), ((0.0, g.L1), (g.L2, g.L1), 0.04)],
        "lower": [((0.0, 0.0), (g.L3, 0.0), 0.03)],
        "inner": [((0.0, 0.0), (g.L9, 0.0), 0.03)],
        "outer": [((0.0, 0.0), (g.L4, 0.0), 0.02)],
        "upper": [
            ((0.0, 0.0), (g.L5, 0.0), 0.03),
            ((0.0, 0.0), (0.0, -g.L6), 0.03),
            ((-g.L7, -g.L6), (rod - g.L7, -g.L6), 0.035),
        ],
        "extension": [((0.0, 0.0), (rod, 0.0), 0.02)],
        "end_effector": [((0.0, 0.0), (0.0, g.L8), 0.025)],
    }
    return {
        name: [
            _Rod(np.array([(*start, 0.0), (*end, 0.0)]) @ R_LINK_BODY[name], radius)
            for start, end, radius in parts
            if start != end
        ]
        for name, parts in lines.items()
    }


def _payload_radius(boom: Boom) -> float:
    return float((boom.payload.mass / _STEEL * 0.75 / np.pi) ** (1.0 / 3.0))


# URDF


def _urdf_link(top: Element, boom: Boom, name: str) -> None:
    element = SubElement(top, "link", name=name)
    body = _body(boom, name)
    if body is not None and body.mass > 0.0:
        inertial = SubElement(element, "inertial")
        SubElement(inertial, "origin", xyz=_text(body.com), rpy="0 0 0")
        SubElement(inertial, "mass", value=_text(body.mass))
        entries = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), body.inertia[np.triu_indices(3)], strict=True)
        SubElement(inertial, "inertia", {key: _text(value) for key, value in entries})
    for rod in _rods(boom).get(name, []):
        along = rod.ends[1] - rod.ends[0]
        origin = {"xyz": _text(rod.ends.mean(axis=0)), "rpy": _text(_rpy_of_z_along(along))}
        geometry = _visual(element, origin, name)
        SubElement(geometry, "cylinder", length=_text(np.linalg.norm(along)), radius=_text(rod.radius))
    if name == "tip" and boom.payload.mass > 0.0:
        geometry = _visual(element, {"xyz": _text(boom.payload.com), "rpy": "0 0 0"}, name)
        SubElement(geometry, "sphere", radius=_text(_payload_radius(boom)))


def _visual(link: Element, origin: dict[str, str], material: str) -> Element:
    visual = SubElement(link, "visual")
    SubElement(visual, "origin", origin)
    geometry = SubElement(visual, "geometry")
    SubElement(visual, "material", name=material)
    return geometry


def _urdf_joint(top: Element, boom: Boom, link: _Link) -> None:
    if link.row is None:
        kind = "fixed"
    else:
        followed = int(np.flatnonzero(link.row)[0])
        kind = "prismatic" if IS_LENGTH[followed] else "revolute"
    element = SubElement(top, "joint", name=link.joint, type=kind)
    SubElement(element, "parent", link=link.parent)
    SubElement(element, "child", link=link.name)
    SubElement(element, "origin", xyz=_text(link.position), rpy=_text(_rpy(link.rotation)))
    if link.row is None:
        return
    SubElement(element, "axis", xyz="0 0 1")
    low, high = _range(boom, link.row)
    effort = _effort(boom, followed)
    limits = (low, high, UNLIMITED_EFFORT if effort is None else effort, boom.limits.velocity[followed])
    SubElement(element, "limit", dict(zip(("lower", "upper", "effort", "velocity"), map(_text, limits), strict=True)))
    if link.joint != JOINTS[followed]:
        multiplier = {"multiplier": _text(link.row[followed]), "offset": "0"}
        SubElement(element, "mimic", multiplier, joint=JOINTS[followed])
    elif boom.friction.origins[followed] is not None:
        friction = boom.friction.viscous[followed], boom.friction.coulomb[followed]
        SubElement(element, "dynamics", damping=_text(friction[0]), friction=_text(friction[1]))


def _urdf_transmission(top: Element, joint: str) -> None:
    """Add an actuator with ratio 1, whose effort is the joint torque."""
    element = SubElement(top, "transmission", name=f"{joint}_transmission")
    SubElement(element, "type").text = "transmission_interface/SimpleTransmission"
    driven = SubElement(element, "joint", name=joint)
    SubElement(driven, "hardwareInterface").text = "hardware_interface/EffortJointInterface"
    actuator = SubElement(element, "actuator", name=joint)
    SubElement(actuator, "mechanicalReduction").text = "1"


def _rpy(R: Array) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll).

    At a pitch of +-90 deg, yaw is 0.
    """
    across = np.hypot(R[0, 0], R[1, 0])
    pitch = float(np.arctan2(-R[2, 0], across))
    if across < 1e-9:
        return float(np.arctan2(-R[1, 2], R[1, 1])), pitch, 0.0
    return float(np.arctan2(R[2, 1], R[2, 2])), pitch, float(np.arctan2(R[1, 0], R[0, 0]))


def _rpy_of_z_along(direction: Array) -> tuple[float, float, float]:
    x, y, z = direction
    return 0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x))


# MJCF


def _mjcf_body(element: Element, boom: Boom, link: _Link) -> None:
    if link.row is not None:
        i = JOINTS.index(link.joint) if link.joint in JOINTS else None
        own: dict[str, str] = {}
        if i is not None:
            numbers = {
                "armature": boom.drive_inertia[i],
                "damping": boom.friction.viscous[i],
                "frictionloss": boom.friction.coulomb[i],
            }
            own = {key: _text(value) for key, value in numbers.items() if value > 0.0}
        kind = "slide" if link.joint == "extension" else "hinge"
        SubElement(element, "joint", own, name=link.joint, type=kind, axis="0 0 1", range=_text(_range(boom, link.row)))
    body = _body(boom, link.name)
    if body is not None and body.mass > 0.0:
        principal = np.diag(body.inertia)
        inertia = {"diaginertia": _text(principal)}
        if (body.inertia != np.diag(principal)).any():
            # MuJoCo diagonalises a full tensor, which must be positive definite.
            inertia = {"fullinertia": _text(body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])}
        SubElement(element, "inertial", inertia, pos=_text(body.com), mass=_text(body.mass))
    drawn = {"rgba": _text((*_COLORS[link.name], 1.0)), "contype": "0", "conaffinity": "0", "group": "2", "mass": "0"}
    for rod in _rods(boom).get(link.name, []):
        SubElement(element, "geom", drawn, type="cylinder", fromto=_text(rod.ends), size=_text(rod.radius))
    if link.name == "tip":
        SubElement(element, "site", name="tip", size="0.01")
        if boom.payload.mass > 0.0:
            SubElement(element, "geom", drawn, type="sphere", pos=_text(boom.payload.com), size=_text(_payload_radius(boom)))


def _text(numbers: ArrayLike) -> str:
    return " ".join(repr(float(x) + 0.0) for x in np.ravel(numbers))


def _document(top: Element) -> str:
    ElementTree.indent(top)
    return ElementTree.tostring(top, encoding="unicode", xml_declaration=True) + "\n"
