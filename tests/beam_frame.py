"""Finite elements of the arm's plane: inner link and extension as beams, everything else rigid,
motors and slides held.

An independent model of the lowest modes: Euler-Bernoulli beams with distributed mass (a density
quadratic along the beam, with the body's mass, centre and inertia), where `planner.control.plant`
has one torsional spring for each. Coordinates are the beams' nodes (deflection and slope) and the
lower link's angle; a point's displacement is linear in them, and the energies follow from those of
the bodies and the beams.
"""

import numpy as np
from numpy.polynomial import Polynomial
from scipy.linalg import eigh

from boom_model.arrays import Array
from boom_model.boom import Body, Boom
from boom_model.kinematics.frames import R_LINK_BODY

ELEMENTS = 24
ROD = 1.2
"""Length [m] of the extension's rod, behind the wrist."""


def frequencies(boom: Boom, q: Array, stiffness: Array, inner_EI: float, extension_EI: float, clear: float) -> Array:
    """The two lowest natural frequencies [Hz] in the arm's plane without gravity.

    Args:
        stiffness: (2,) of the gearboxes of joints 2 and 3 [Nm/rad].
        inner_EI, extension_EI: bending stiffness of the beams [Nm^2].
        clear: length of the retracted extension outside its housing [m].
    """
    g, n = boom.geometry, ELEMENTS
    rho, free, turn = g.L7 + q[3], clear + q[3], q[2] + q[4]
    e2, p2 = _axes(q[1])
    e3, p3 = _axes(q[2])
    et, pt = _axes(turn)
    # x = inner beam's (deflection, slope) at nodes 1..n and its slope at the root; lower angle;
    # extension's at nodes 1..n
    size = 1 + 2 * n + 1 + 2 * n
    unit = np.eye(size)
    slope_2, phi = unit[0], unit[1 + 2 * n]
    inner = [(np.zeros(size), slope_2)] + [(unit[1 + 2 * i], unit[2 + 2 * i]) for i in range(n)]
    tip_2 = inner[-1][0]
    M, K = np.zeros((size, size)), np.zeros((size, size))
    K += stiffness[0] * np.outer(slope_2, slope_2) + stiffness[1] * np.outer(phi, phi)

    def point(mass: float, shift: Array) -> None:
        M[:] += mass * shift.T @ shift

    def rigid(name: str, e: Array, p: Array, place: Array, moves: Array, angle: Array) -> None:
        """A body whose frame's origin is at `place` and moves by `moves` (2, size), turning by
        `angle` (size,)."""
        body = {**boom.bodies, "payload": boom.payload}[name]
        com = R_LINK_BODY[name] @ body.com
        point(body.mass, moves + np.outer(_across(com[0] * e + com[1] * p), angle))
        M[:] += (R_LINK_BODY[name] @ body.inertia @ R_LINK_BODY[name].T)[2, 2] * np.outer(angle, angle)

    def beam(nodes: list[tuple[Array, Array]], length: float, EI: float, densities: Array, drag: Array) -> None:
        """Equal elements of `densities` (n,) [kg/m]; `drag` (size,) is the motion
        along the beam."""
        h = length / n
        H = np.diag([1.0, h, 1.0, h])
        bend = np.array([[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]])
        near, far = np.array([[156.0, 22.0], [22.0, 4.0]]), np.array([[54.0, -13.0], [13.0, -3.0]])
        mirror = np.diag([1.0, -1.0])
        swing = np.block([[near, far], [far.T, mirror @ near @ mirror]])
        k, m = EI / h**3 * H @ bend @ H, h / 420.0 * H @ swing @ H
        for left, right, density in zip(nodes[:-1], nodes[1:], densities, strict=True):
            rows = np.stack([*left, *right])
            K[:] += rows.T @ k @ rows
            M[:] += density * rows.T @ m @ rows
        M[:] += densities.sum() * h * np.outer(drag, drag)

    zero = np.zeros((2, size))
    middle = (np.arange(n) + 0.5) / n
    beam(inner, g.L9, inner_EI, _density(boom.bodies["inner"], g.L9, 0, 1.0)(g.L9 * middle), np.zeros(size))
    rigid("lower", e3, p3, zero, zero, phi)
    pin6 = np.outer(_across(g.L3 * e3), phi)
    rigid("outer", e2, p2, zero, pin6, tip_2 / g.L9)
    pin8 = np.outer(p2, tip_2)
    rigid("upper", e3, p3, zero, pin8, phi)

    def housed(behind: float) -> Array:
        """Motion (2, size) of the actuator's axis, `behind` the wrist, as part of the housing."""
        return pin8 + np.outer(_across(-g.L6 * p3 - (rho - behind) * e3), phi)

    density = _density(boom.bodies["extension"], ROD, 2, -1.0)  # by the way behind the wrist
    pieces = np.linspace(free, ROD, 201)
    for behind, h in zip((pieces[1:] + pieces[:-1]) / 2.0, np.diff(pieces), strict=True):
        point(density(behind) * h, housed(behind))
    root = housed(free)
    # The beam leaves its root towards -e3; its own axes are -e3 along and -p3 across, so that it
    # turns as phi does.
    nodes = [(-p3 @ root, phi)] + [(unit[2 + 2 * n + 2 * i], unit[3 + 2 * n + 2 * i]) for i in range(n)]
    beam(nodes, free, extension_EI, density(free * (1.0 - middle)), e3 @ root)
    wrist = np.outer(e3, e3 @ root) - np.outer(p3, nodes[-1][0])
    angle = nodes[-1][1]
    rigid("end_effector", et, pt, zero, wrist, angle)
    rigid("payload", et, pt, zero, wrist + np.outer(_across(g.L8 * pt), angle), angle)
    squares = eigh(K, M, eigvals_only=True, subset_by_index=[0, 1])
    return np.sqrt(squares) / (2.0 * np.pi)


def _density(body: Body, length: float, axis: int, sign: float) -> Polynomial:
    """kg/m along a rod from 0 to `length`, quadratic, with the body's mass, centre and inertia
    across that axis."""
    center, inertia = sign * body.com[axis], body.inertia[1, 1] + body.mass * body.com[axis] ** 2
    moments = [[length ** (i + j + 1) / (i + j + 1) for j in range(3)] for i in range(3)]
    return Polynomial(np.linalg.solve(moments, [body.mass, body.mass * center, inertia]))


def _axes(angle: float) -> tuple[Array, Array]:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c, s]), np.array([-s, c])


def _across(r: Array) -> Array:
    """Displacement of a point at r under a small turn of 1."""
    return np.array([-r[1], r[0]])
