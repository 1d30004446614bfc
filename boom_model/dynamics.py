"""Newton-Euler over the closed linkage: joint torques, pin forces and the wrench on the vehicle's mount.

Every body is followed in the arm's plane, which yaws with theta1: axes x forward, z up and n = x cross z, the plane's normal
(to the boom's right), origin in frame 1. A link at angle a has its own axes e = (cos a, sin a, 0), p = (-sin a, cos a, 0)
and n. The plane turns with angular velocity W (the vehicle's, and theta1's rate about z), so a point c of the plane has

    a = a0 + W' x c + W x (W x c) + 2 W x c' + c''      (thesis, eqs. 2.41, 2.42 and 2.44 as corrected)

with a0 the base's acceleration less gravity, and each body needs F = m a and N = J w' + w x J w (eqs. 2.45, 2.46). The
equilibrium of extension, upper, outer, inner and lower link then gives the pins and the joint torques.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, read_only
from boom_model.boom import Body, Boom
from boom_model.errors import InputError
from boom_model.frames import R_LINK_BODY

PayloadAs = Literal["mass", "force"]

_CHUNK = 2048  # samples at once: the working arrays of a chunk stay in the processor's cache


@dataclass(frozen=True, eq=False)
class PinForces:
    """Forces at the linkage's pins [N], each (..., 3) in frame 4: x forward, y to the left, z up, yawing with theta1.

    They lie in the arm's plane: how pins 7 and 8 share the lateral load is statically indeterminate, so y is 0. They grow
    as 1/sin(theta3 - theta2) towards the flat parallelogram, and are infinite or NaN there.
    """

    frame_6: Array
    """of the lower link on the outer link"""
    frame_7: Array
    """of the outer link on the upper link"""
    frame_8: Array
    """of the inner link on the upper link"""


@dataclass(frozen=True, eq=False)
class Loads:
    """What a motion asks of the boom."""

    tau: Array
    """(..., 5) joint torques [Nm], the extension's force [N], positive along the joint coordinate."""
    pins: PinForces | None
    """None where reactions were not asked for."""
    mount: Array | None
    """(..., 6) force [N] and moment [Nm] of the boom on the vehicle's mount, in and about frame 1; None likewise."""


def inverse_dynamics(
    boom: Boom,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    *,
    payload_as: PayloadAs = "mass",
    reactions: bool = True,
) -> Loads:
    """Joint torques, pin forces and mount wrench for a motion, by Newton-Euler (thesis, eqs. 2.45-2.71 as corrected).

    Frictionless, rigid, on a base at rest.

    Args:
        q, qd, qdd: (..., 5) joint positions, velocities, accelerations [rad, the extension in m]; they broadcast.
        payload_as: "mass" accelerates the payload with the tip; "force" hangs its weight there and leaves its inertia out,
            as the thesis does.
        reactions: whether to compute pin forces and mount wrench too.

    Raises:
        InputError: an input is not finite or not (..., 5), or shapes do not match.
    """
    if payload_as not in ("mass", "force"):
        raise InputError(f"payload_as is {payload_as!r}; it must be 'mass' or 'force'")
    positions, rates, accelerations = broadcast(q=q, qd=qd, qdd=qdd)
    shape = positions.shape[:-1]
    motion = [np.reshape(x, (-1, 5)) for x in (positions, rates, accelerations)]
    count = len(motion[0])
    tau = np.empty((count, 5))
    pins = np.zeros((3, count, 3)) if reactions else None
    mount = np.empty((count, 6)) if reactions else None
    model = _model(boom, payload_as)
    for start in range(0, count, _CHUNK):
        part = slice(start, start + _CHUNK)
        p, v, a = (np.ascontiguousarray(x[part].T) for x in motion)
        outputs = (tau[part], None if pins is None else pins[:, part], None if mount is None else mount[part])
        _newton_euler(model, p, v, a, *outputs)
    return Loads(
        tau=tau.reshape(*shape, 5),
        pins=None if pins is None else PinForces(*(p.reshape(*shape, 3) for p in pins)),
        mount=None if mount is None else mount.reshape(*shape, 6),
    )


class _LinkBody(NamedTuple):
    """A body in its link's axes (e, p, n), about the link's own pivot."""

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]
    """about the centre of mass: ee, pp, nn, ep, en, pn"""


class _Model(NamedTuple):
    boom: Boom
    base: _LinkBody
    lower: _LinkBody
    inner: _LinkBody
    outer: _LinkBody
    upper: _LinkBody
    extension: _LinkBody
    tool: _LinkBody
    """end effector, with the payload where it has mass"""
    hanging: float
    """payload that is a force [kg]"""


@lru_cache(maxsize=16)
def _model(boom: Boom, payload_as: PayloadAs) -> _Model:
    links = {name: _in_link_axes(body, R_LINK_BODY[name]) for name, body in boom.bodies.items()}
    tool = links.pop("end_effector")
    if payload_as == "mass" and boom.payload > 0:
        tip = np.array([0.0, boom.geometry.L8, 0.0])
        mass = tool.mass + boom.payload
        com = (tool.mass * tool.com + boom.payload * tip) / mass
        inertia = tool.inertia + _point_inertia(tool.mass, tool.com - com) + _point_inertia(boom.payload, tip - com)
        tool = Body(mass, com, inertia)
    return _Model(
        boom=boom,
        tool=_flat(tool),
        hanging=boom.payload if payload_as == "force" else 0.0,
        **{name: _flat(body) for name, body in links.items()},
    )


def _in_link_axes(body: Body, R: Array) -> Body:
    return Body(body.mass, read_only(R @ body.com), read_only(R @ body.inertia @ R.T))


def _point_inertia(mass: float, arm: Array) -> Array:
    inertia: Array = mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return inertia


def _flat(body: Body) -> _LinkBody:
    i = body.inertia
    com = (float(body.com[0]), float(body.com[1]), float(body.com[2]))
    tensor = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    return _LinkBody(body.mass, com, tuple(map(float, tensor)))  # type: ignore[arg-type]


class _Point(NamedTuple):
    """A point of the plane: position, and velocity and acceleration as seen from the plane."""

    x: Array | float
    z: Array | float
    vx: Array | float = 0.0
    vz: Array | float = 0.0
    ax: Array | float = 0.0
    az: Array | float = 0.0


class _Link(NamedTuple):
    """A link's angle: cosine and sine, rate, acceleration."""

    c: Array | float
    s: Array | float
    rate: Array | float
    accel: Array | float

    def carry(self, pivot: _Point, u: float | Array, v: float) -> _Point:
        """The point at u along e and v along p from the pivot."""
        rx, rz = u * self.c - v * self.s, u * self.s + v * self.c
        square = self.rate * self.rate
        return _Point(
            pivot.x + rx,
            pivot.z + rz,
            pivot.vx - self.rate * rz,
            pivot.vz + self.rate * rx,
            pivot.ax - self.accel * rz - square * rx,
            pivot.az + self.accel * rx - square * rz,
        )


class _Yaw(NamedTuple):
    """How the plane itself moves: yaw rate and acceleration, and gravity."""

    rate: Array
    accel: Array
    gravity: float


class _Demand(NamedTuple):
    """Force and moment that a body's motion needs, in the plane's axes, with where the force acts."""

    x: Array | float
    z: Array | float
    n: float
    Fx: Array
    Fz: Array | float
    Fn: Array
    Nx: Array
    Nz: Array
    Nn: Array

    def moment(self, pivot: _Point) -> Array:
        """About the plane's normal through a pivot."""
        return self.Nn + (self.x - pivot.x) * self.Fz - (self.z - pivot.z) * self.Fx


def _demand(body: _LinkBody, link: _Link, com: _Point, yaw: _Yaw) -> _Demand:
    n, W, W1 = body.com[2], yaw.rate, yaw.accel
    Fx = body.mass * (com.ax - W * W * com.x + W1 * n)
    Fz = body.mass * (com.az + yaw.gravity)
    Fn = body.mass * (-W1 * com.x - W * W * n - 2.0 * W * com.vx)

    # Angular velocity and acceleration along the link's axes: the plane's (about z) and the link's own (about n).
    we, wp, wn = W * link.s, W * link.c, link.rate
    ae, ap, an = W1 * link.s + wn * wp, W1 * link.c - wn * we, link.accel
    ee, pp, nn, ep, en, pn = body.inertia
    he, hp, hn = ee * we, pp * wp, nn * wn
    Ne, Np, Nn = ee * ae, pp * ap, nn * an
    if ep or en or pn:
        he, hp, hn = he + ep * wp + en * wn, hp + ep * we + pn * wn, hn + en * we + pn * wp
        Ne, Np, Nn = Ne + ep * ap + en * an, Np + ep * ae + pn * an, Nn + en * ae + pn * ap
    Ne, Np, Nn = Ne + wp * hn - wn * hp, Np + wn * he - we * hn, Nn + we * hp - wp * he
    return _Demand(com.x, com.z, n, Fx, Fz, Fn, Ne * link.c - Np * link.s, Ne * link.s + Np * link.c, Nn)


def _newton_euler(model: _Model, q: Array, qd: Array, qdd: Array, tau: Array, pins: Array | None, mount: Array | None) -> None:
    """Fills tau (n, 5), pins (3, n, 3) and mount (n, 6) for a chunk of states, each (5, n)."""
    g, still = model.boom.geometry, _Point(0.0, 0.0)
    yaw = _Yaw(qd[0], qdd[0], model.boom.gravity)
    angles = np.stack([q[1], q[2], q[2] + q[4]])
    cosines, sines = np.cos(angles), np.sin(angles)
    inner = _Link(cosines[0], sines[0], qd[1], qdd[1])
    lower = _Link(cosines[1], sines[1], qd[2], qdd[2])
    tool = _Link(cosines[2], sines[2], qd[2] + qd[4], qdd[2] + qdd[4])

    shoulder = _Point(g.L2, g.L1)
    pin6 = lower.carry(shoulder, g.L3, 0.0)
    pin8 = inner.carry(shoulder, g.L9, 0.0)
    slider = _slide(lower, lower.carry(pin8, 0.0, -g.L6), g.L7 + q[3], qd[3], qdd[3])

    def needs(body: _LinkBody, link: _Link, pivot: _Point) -> _Demand:
        return _demand(body, link, link.carry(pivot, body.com[0], body.com[1]), yaw)

    on_base = needs(model.base, _Link(1.0, 0.0, 0.0, 0.0), still)
    on_lower = needs(model.lower, lower, shoulder)
    on_inner = needs(model.inner, inner, shoulder)
    on_outer = needs(model.outer, inner, pin6)
    on_upper = needs(model.upper, lower, pin8)
    on_extension = needs(model.extension, lower, slider)
    on_tool = needs(model.tool, tool, slider)
    everything = [on_base, on_lower, on_inner, on_outer, on_upper, on_extension, on_tool]
    tau5 = on_tool.moment(slider)
    if model.hanging:
        zero = np.zeros_like(q[0])
        tip = tool.carry(slider, 0.0, g.L8)
        weight = np.full_like(zero, model.hanging * model.boom.gravity)
        hanging = _Demand(tip.x, tip.z, 0.0, zero, weight, zero, zero, zero, zero)
        everything.append(hanging)
        tau5 = tau5 + hanging.moment(slider)

    outboard = everything[5:]  # what the actuator carries
    top = everything[4:]  # what the pins 7 and 8 carry
    Fx_top, Fz_top = sum(d.Fx for d in top), sum(d.Fz for d in top)
    M_top = sum(d.moment(pin8) for d in top)
    M_outer = on_outer.moment(pin6)

    # Pin 7 lies L5 along the lower link's direction from pin 8 and L4 along the inner link's from pin 6. Moments about
    # pin 8 and pin 6 give its force across either direction, which is all that the torques need:
    # f7 . p_lower = M_top / L5 and f7 . p_inner = -M_outer / L4.
    tau[:, 0] = sum(d.Nz + d.n * d.Fx - d.x * d.Fn for d in everything)
    tau[:, 1] = on_inner.moment(shoulder) + g.L9 * (inner.c * Fz_top - inner.s * Fx_top) + M_outer
    tau[:, 2] = on_lower.moment(shoulder) + g.L3 * (lower.c * on_outer.Fz - lower.s * on_outer.Fx) + M_top
    tau[:, 3] = -lower.c * sum(d.Fx for d in outboard) - lower.s * sum(d.Fz for d in outboard)
    tau[:, 4] = tau5

    if pins is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = lower.s * inner.c - lower.c * inner.s
            along_inner, along_lower = -M_top / (g.L5 * sine), -M_outer / (g.L4 * sine)
            f7x = along_inner * inner.c + along_lower * lower.c
            f7z = along_inner * inner.s + along_lower * lower.s
        pins[0, :, 0], pins[0, :, 2] = on_outer.Fx + f7x, on_outer.Fz + f7z
        pins[1, :, 0], pins[1, :, 2] = f7x, f7z
        pins[2, :, 0], pins[2, :, 2] = Fx_top - f7x, Fz_top - f7z
    if mount is not None:
        Fx, Fz, Fn = (sum(getattr(d, k) for d in everything) for k in ("Fx", "Fz", "Fn"))
        Mx = sum(d.Nx + d.z * d.Fn - d.n * d.Fz for d in everything)
        Mn = sum(d.Nn + d.x * d.Fz - d.z * d.Fx for d in everything)
        c1, s1 = np.cos(q[0]), np.sin(q[0])
        for row, (along, normal) in ((0, (Fx, Fn)), (3, (Mx, Mn))):
            mount[:, row] = -(c1 * along + s1 * normal)
            mount[:, row + 1] = -(s1 * along - c1 * normal)
        mount[:, 2] = -Fz
        mount[:, 5] = -tau[:, 0]


def _slide(lower: _Link, axis: _Point, rho: Array, speed: Array, accel: Array) -> _Point:
    """The wrist: rho out along the actuator, which points along -e of the lower link (thesis, eq. 2.42)."""
    wrist = lower.carry(axis, -rho, 0.0)
    coriolis = 2.0 * lower.rate * speed
    return _Point(
        wrist.x,
        wrist.z,
        wrist.vx - speed * lower.c,
        wrist.vz - speed * lower.s,
        wrist.ax - accel * lower.c + coriolis * lower.s,
        wrist.az - accel * lower.s - coriolis * lower.c,
    )
