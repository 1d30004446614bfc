"""Newton-Euler over the closed linkage: joint torques, pin forces and mount wrench.

The inertial parameters are regrouped. Every body is followed in the arm's plane, which yaws with
theta1. Its axes are x forward, z up and the plane's normal n = x cross z (to the boom's right); its
origin is that of frame 1. A link at angle a has its own axes e = (cos a, sin a, 0),
p = (-sin a, cos a, 0) and n. Any mass element then stands at c = sum_i g_i b_i, with constants g_i
and the eleven vectors

    b = o, x, z, n, e2, p2, e3, p3, rho e3, et, pt

Here o is the origin itself, and 2, 3, t stand for theta2, theta3, theta3 + theta5. The acceleration
of the mass element less gravity is sum_i g_i A_i. With the plane's angular velocity W and the
base's acceleration a0,

    A_o = a0 - gravity,   A_i = W' x b + W x (W x b) + 2 W x b' + b''

These are eqs. 2.41, 2.42 and 2.44 of the thesis, as corrected.

Newton's and Euler's equations of a set of bodies ask no more of its masses than the constant
Q = int g g^T dm. With U = Q A, the force on the set is U_o, and its moment about any pin a sum of
b_i x U_i. The equilibrium of tool, extension, upper, outer, inner and lower link gives the joint
torques and the pin forces from these (eqs. 2.45-2.71).

Where opposite links are unequal, the upper link turns at psi and the outer one at chi (see
`linkage`). Then psi stands in the place of theta3 above, and four vectors more are needed: el, pl
of the lower link at theta3, and eo, po of the outer one at chi. The torque of theta2 is the sum of
the torques at theta2, psi and chi, each times the derivative of its angle by theta2; that of theta3
likewise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from boom_model.arrays import Array, broadcast, checked, read_only
from boom_model.boom import Body, Boom, Geometry
from boom_model.dynamics.base_motion import BaseMotion
from boom_model.errors import InputError
from boom_model.kinematics.frames import R_LINK_BODY
from boom_model.kinematics.linkage import Loop, Value, solved_loop
from boom_model.trigonometry import cosine_and_sine

PayloadAs = Literal["mass", "force"]

_CHUNK = 1280
"""Samples at once. The working arrays of a chunk stay in the processor's cache, and OpenBLAS takes
its products on one thread: a second one gains nothing on so thin a matrix, and waits for its turn
on a busy machine."""

_O, _X, _Z, _N, _E2, _P2, _E3, _P3, _RHO, _ET, _PT, _EL, _PL, _EO, _PO = range(15)
"""The vectors b; the last four are those of a linkage of unequal links alone."""
_ONE = (5,)
_NOTHING = (0.0, 0.0, 0.0)
BASE_ENTRIES = ("angular_velocity", "angular_acceleration", "acceleration", "up")
_LINKS = ((_E2, _P2), (_E3, _P3), (_ET, _PT), (_EL, _PL), (_EO, _PO))


@dataclass(frozen=True, eq=False)
class PinForces:
    """Forces at the linkage's pins [N], each (..., 3) in frame 4.

    Frame 4 yaws with theta1: x forward, y to the left, z up. The forces lie in the arm's plane: how
    pins 7 and 8 share the load across it is statically indeterminate, so y is 0. They grow as
    1/sin(theta3 - theta2) towards the flat parallelogram, where no finite force is right, and as
    1/sin(chi - psi) where links are unequal: see `transmission_angle`.
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
    """(..., 5) joint torques [Nm], the extension's force [N], positive along the joint coordinate.
    """
    pins: PinForces | None
    """None where reactions were not asked for."""
    mount: Array | None
    """(..., 6) force [N] and moment [Nm] of the boom on the vehicle's mount, in and about frame 1;
    None likewise."""


def inverse_dynamics(
    boom: Boom,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    *,
    base: BaseMotion | None = None,
    payload_as: PayloadAs = "mass",
    tip_force: ArrayLike | None = None,
    tip_moment: ArrayLike | None = None,
    friction: bool = False,
    drive_inertia: bool = False,
    reactions: bool = True,
) -> Loads:
    """Compute joint torques, pin forces and mount wrench of a motion.

    Newton-Euler method (thesis, eqs. 2.45-2.71 as corrected). q, qd and qdd broadcast.

    Args:
        boom: the boom.
        q: (..., 5) joint positions [rad, m for the extension].
        qd: (..., 5) joint velocities [rad/s, m/s].
        qdd: (..., 5) joint accelerations [rad/s^2, m/s^2].
        base: how the vehicle moves the base, each entry (3,) or (..., 3); None is at rest on level
            ground.
        payload_as: "mass" moves the payload with the tip; "force" hangs its weight there and leaves
            its inertia out, as the thesis does.
        tip_force: (..., 3) external force on the tip, along frame 1 [N].
        tip_moment: (..., 3) external moment on the tip, along frame 1 [Nm].
        friction: whether tau overcomes the joints' friction, viscous qd + coulomb sign(qd).
        drive_inertia: whether tau accelerates the drives' reflected inertia N^2 (J_rotor + J_gear)
            too, where it is known. Friction and drive inertia are added to tau alone; their
            reaction on the pins and the mount is left out.
        reactions: whether to compute pin forces and mount wrench.

    Raises:
        InputError: an input is not finite or of the wrong shape, or shapes do not match.
        InfeasibleError: a linkage of unequal links cannot close at q.

    >>> boom = Boom.load()
    >>> loads = inverse_dynamics(boom, boom.pose("phenotyping"), np.zeros(5), np.zeros(5))
    >>> [round(float(x), 1) + 0.0 for x in loads.tau]
    [0.0, 110.2, 200.3, 0.0, 0.0]
    """
    if payload_as not in ("mass", "force"):
        raise InputError(f"payload_as is {payload_as!r}; it must be 'mass' or 'force'")
    plain = base is None and tip_force is None and tip_moment is None and payload_as == "mass"
    if plain and not (reactions or friction or drive_inertia):
        tau = _single(boom, q, qd, qdd)
        if tau is not None:
            return Loads(tau, None, None)
    positions, rates, accelerations = broadcast(q=q, qd=qd, qdd=qdd)
    shape = positions.shape[:-1]
    motion = [x.reshape(-1, 5) for x in (positions, rates, accelerations)]
    outside = base_series(base, shape)
    push = None if tip_force is None else matched("tip_force", tip_force, shape)
    twist = None if tip_moment is None else matched("tip_moment", tip_moment, shape)
    count = len(motion[0])
    out = _Outputs(
        np.empty((5, count)).T,
        np.zeros((3, 3, count)).swapaxes(1, 2) if reactions else None,
        np.empty((6, count)).T if reactions else None,
    )
    model = regrouped(boom, payload_as)
    rotors = boom.drive_inertia if drive_inertia else None

    def fill(motion: list[Array], outside: list[Array], push: Array | None, twist: Array | None, out: _Outputs) -> None:
        state = _state(motion)
        plane = _plane(boom, state, *map(_columns, outside))
        force = None if push is None else _into_plane(state, _columns(push))
        moment = None if twist is None else _into_plane(state, _columns(twist))
        _newton_euler(model, state, plane, force, moment, out)
        if friction:
            out.tau[:] += boom.friction.torque(motion[1])
        if rotors is not None:
            out.tau[:] += rotors * motion[2]

    if count <= _CHUNK:
        fill(motion, outside, push, twist, out)
    else:
        for start in range(0, count, _CHUNK):
            part = slice(start, start + _CHUNK)
            applied, turned = (None if x is None else x[part] for x in (push, twist))
            fill([x[part] for x in motion], [x[part] for x in outside], applied, turned, out.part(part))
    pins, mount = None, None
    if out.pins is not None and out.mount is not None:
        pins, mount = PinForces(*(p.reshape(*shape, 3) for p in out.pins)), out.mount.reshape(*shape, 6)
    return Loads(out.tau.reshape(positions.shape), pins, mount)


def weight_torque(boom: Boom, q: Array, up: Array | None = None) -> Array:
    """Return the torque (n, 5) that carries bodies and payload at rest.

    Without motion, A is minus gravity for the origin o and 0 for every other vector b.

    Args:
        boom: the boom.
        q: (n, 5) joint positions.
        up: (n, 3) unit vector against gravity, along frame 1; None on level ground.
    """
    state = _State(*[list(np.ascontiguousarray(q.T))] * 3)
    x, z, n = (0.0, boom.gravity, 0.0) if up is None else (boom.gravity * a for a in _into_plane(state, list(up.T)))
    Q = regrouped(boom, "mass").torque_rows[:, _O].tolist()
    U = tuple([moment * along for moment in Q] for along in (x, z, n))
    links, loop = _turns(boom.geometry, state)
    torques = _torques(boom.geometry.L7 + state.q[3], links, loop, U, _NOTHING)[0]
    tau = np.empty((5, len(q)))
    for row, torque in zip(tau, torques, strict=True):
        row[:] = torque
    return tau.T


def inner_link_load(q: ArrayLike, pins: PinForces) -> Array:
    """Return the force (..., 3) [N] that the inner link carries at its upper pin.

    It is in frame 5 of the inner loop, with x along the link. Chapter 3's f_B: the reaction to the
    inner link's force on the upper link at frame 8.

    Raises:
        InputError: q is not finite or not (..., 5).
    """
    theta2 = checked("q", q, 5)[..., 1]
    c, s = np.cos(theta2), np.sin(theta2)
    x, z = pins.frame_8[..., 0], pins.frame_8[..., 2]
    return np.stack([-(c * x + s * z), s * x - c * z, np.zeros_like(x)], axis=-1)


def base_series(base: BaseMotion | None, shape: tuple[int, ...]) -> list[Array]:
    """Return the entries of a base motion at states of a shape, flattened to (n, 3); [] for None.

    Raises:
        InputError: an entry does not match the states.
    """
    return [] if base is None else [matched(f"base {name}", getattr(base, name), shape) for name in BASE_ENTRIES]


def element_accelerations(boom: Boom, q: Array, qd: Array, qdd: Array, *base: Array) -> Array:
    """Return A (3, m, n) of the m vectors b at n states (n, 5) along x, z and n.

    The base moves as `base_series` says.

    Raises:
        InfeasibleError: a linkage of unequal links cannot close at q.
    """
    state = _State(*(list(np.ascontiguousarray(x.T)) for x in (q, qd, qdd)))
    plane = _plane(boom, state, *(list(x.T) for x in base))
    links, _ = _turns(boom.geometry, state)
    return np.asarray(_accelerations(state, plane, links, boom.geometry.L7 + q[:, 3]))


def element_velocities(boom: Boom, q: Array) -> Array:
    """Return db/dq (5, 3, m, n) of every joint and vector b at n states (n, 5), along x, z and n.

    Yaw turns the plane about z: x goes to -n, n to x. An angle turns its links' e to p, and p to
    -e.

    Raises:
        InfeasibleError: a linkage of unequal links cannot close at q.
    """
    columns, still = list(np.ascontiguousarray(q.T)), [np.zeros(len(q))] * 5
    links, loop = _turns(boom.geometry, _State(columns, still, still))
    rho, (c3, s3) = boom.geometry.L7 + q[:, 3], (links[1][0], links[1][1])
    by: tuple[dict[int, Value], ...]  # the joint's derivative of the angle of each link
    if loop is None:
        by = ({}, {0: 1.0}, {1: 1.0, 2: 1.0}, {}, {2: 1.0})
    else:
        (psi_2, psi_3), (chi_2, chi_3) = loop.upper_by, loop.outer_by
        by = ({}, {0: 1.0, 1: psi_2, 2: psi_2, 4: chi_2}, {1: psi_3, 2: psi_3, 3: 1.0, 4: chi_3}, {}, {2: 1.0})
    moved = np.zeros((5, 3, _count(boom.geometry), len(q)))
    moved[0, 0, _N] = 1.0
    moved[0, 2, _X] = -1.0
    moved[0, 2, _RHO] = -rho * c3
    moved[3, 0, _RHO], moved[3, 1, _RHO] = c3, s3
    for i, ((e, p), link) in enumerate(zip(_LINKS, links, strict=False)):
        moved[0, 2, e], moved[0, 2, p] = -link[0], link[1]
        for joint, turned in enumerate(by):
            if i in turned:
                along, across = turned[i] * link[0], turned[i] * link[1]
                moved[joint, 0, e], moved[joint, 1, e] = -across, along
                moved[joint, 0, p], moved[joint, 1, p] = -along, -across
                if i == 1:
                    moved[joint, 0, _RHO], moved[joint, 1, _RHO] = -rho * across, rho * along
    return moved


class Regrouped(NamedTuple):
    """The boom's masses, regrouped."""

    boom: Boom
    rows: Array
    """(m + 6, m), of m vectors b: Q of all bodies; then Q of the outer link (o, e2, p2) and of all
    beyond pins 7 and 8 (o, e3, p3)."""
    torque_rows: Array
    """(m, m): Q of all bodies alone."""
    tip: Array
    """(m,) g of the tip."""
    payload: Array
    """(m,) g of the payload's centre of mass."""
    hanging: float
    """Payload that is a force [kg]."""


@lru_cache(maxsize=16)
def regrouped(boom: Boom, payload_as: PayloadAs) -> Regrouped:
    """Return the regrouped masses of a boom, with the payload as a mass or as a force."""
    elements = body_elements(boom)
    bodies = {**boom.bodies, "payload": boom.payload}
    Q = {name: elements[name].T @ _pseudo_inertia(body, R_LINK_BODY[name]) @ elements[name] for name, body in bodies.items()}
    none = np.zeros((_count(boom.geometry), _count(boom.geometry)))
    if payload_as == "force":
        Q["payload"] = none
    top = sum((Q[name] for name in ("upper", "extension", "end_effector", "payload")), none)
    outer = (_E2, _P2) if boom.geometry.is_parallelogram else (_EO, _PO)
    rows = [sum(Q.values(), none), Q["outer"][[_O, *outer]], top[[_O, _E3, _P3]]]
    com = R_LINK_BODY["payload"] @ boom.payload.com
    return Regrouped(
        boom=boom,
        rows=read_only(np.concatenate(rows)),
        torque_rows=read_only(rows[0]),
        tip=elements["payload"][0],
        payload=elements["payload"].T @ [1.0, *com],
        hanging=boom.payload.mass if payload_as == "force" else 0.0,
    )


def body_elements(boom: Boom) -> dict[str, Array]:
    """Return g of each body's frame origin, and its change per metre along e, p and n, (4, m)."""
    g, unit = boom.geometry, np.eye(_count(boom.geometry))
    lower, outer = ((_E3, _P3), (_E2, _P2)) if g.is_parallelogram else ((_EL, _PL), (_EO, _PO))
    shoulder = unit[_O] + g.L2 * unit[_X] + g.L1 * unit[_Z]
    pin6 = shoulder + g.L3 * unit[lower[0]]
    pin8 = shoulder + g.L9 * unit[_E2]
    wrist = pin8 - g.L6 * unit[_P3] - unit[_RHO]
    placed = {
        "base": (unit[_O], _X, _Z),
        "lower": (shoulder, *lower),
        "inner": (shoulder, _E2, _P2),
        "outer": (pin6, *outer),
        "upper": (pin8, _E3, _P3),
        "extension": (wrist, _E3, _P3),
        "end_effector": (wrist, _ET, _PT),
        "payload": (wrist + g.L8 * unit[_PT], _ET, _PT),
    }
    return {name: np.stack([origin, unit[e], unit[p], unit[_N]]) for name, (origin, e, p) in placed.items()}


def _count(g: Geometry) -> int:
    """Return m, the number of the vectors b."""
    return 11 if g.is_parallelogram else 15


def _pseudo_inertia(body: Body, R: Array) -> Array:
    """Return int (1, r) (1, r)^T dm over a body, r along the axes of its link: (4, 4)."""
    com, inertia = R @ body.com, R @ body.inertia @ R.T
    moments = np.empty((4, 4))
    moments[0, 0] = body.mass
    moments[0, 1:] = moments[1:, 0] = body.mass * com
    moments[1:, 1:] = 0.5 * np.trace(inertia) * np.eye(3) - inertia + body.mass * np.outer(com, com)
    return moments


_Rows = Array | list[list[float]]
"""Values of vectors along x, z and n: an array (3, k, n), or three lists of k numbers of a single
state."""


class _State(NamedTuple):
    """A chunk of states, each five values."""

    q: Sequence[Value]
    qd: Sequence[Value]
    qdd: Sequence[Value]


def _state(motion: list[Array]) -> _State:
    q, qd, qdd = motion
    if len(q) == 1:
        return _State(q[0].tolist(), qd[0].tolist(), qdd[0].tolist())
    return _State(*(list(np.ascontiguousarray(x.T)) for x in motion))


def _columns(vectors: Array) -> Sequence[Value]:
    """Return x, y and z of vectors (n, 3)."""
    return vectors[0].tolist() if len(vectors) == 1 else list(vectors.T)


_Vector = tuple[Value, Value, Value]
"""Along the axes x, z and n of the arm's plane."""


class _Plane(NamedTuple):
    """How the arm's plane moves; entries (n,) or a number each."""

    lift: _Vector
    """minus gravity"""
    a: _Vector
    """a0 minus gravity"""
    W: _Vector
    W1: _Vector
    level: bool
    """Whether the base is at rest on level ground."""


class _Outputs(NamedTuple):
    """Results of a chunk. In memory, each component of all states is one run of numbers."""

    tau: Array
    pins: Array | None
    """(3, n, 3)"""
    mount: Array | None

    def part(self, samples: slice) -> "_Outputs":
        return _Outputs(
            self.tau[samples],
            None if self.pins is None else self.pins[:, samples],
            None if self.mount is None else self.mount[samples],
        )


def matched(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return checked vectors (n, 3) for the n states of a shape.

    Raises:
        InputError: they are not finite or not (..., 3), or the shape does not match.
    """
    values = checked(name, values, 3)
    try:
        return np.reshape(np.broadcast_to(values, (*shape, 3)), (-1, 3))
    except ValueError:
        raise InputError(f"{name} has shape {values.shape}; it does not match states of shape {(*shape, 5)}") from None


def _into_plane(state: _State, vector: Sequence[Value]) -> _Vector:
    """Return the components of a vector, given along frame 1, along x, z and n of the plane."""
    c, s = cosine_and_sine(state.q[0])
    return c * vector[0] + s * vector[1], vector[2], s * vector[0] - c * vector[1]


def _plane(boom: Boom, state: _State, *base: Sequence[Value]) -> _Plane:
    rate, accel = state.qd[0], state.qdd[0]
    if not base:
        level = (0.0, boom.gravity, 0.0)
        return _Plane(level, level, (0.0, rate, 0.0), (0.0, accel, 0.0), True)
    angular_velocity, angular_acceleration, acceleration, up = (_into_plane(state, x) for x in base)
    w1, w2, w3 = angular_velocity
    d1, d2, d3 = angular_acceleration
    lift = (boom.gravity * up[0], boom.gravity * up[1], boom.gravity * up[2])
    a = (acceleration[0] + lift[0], acceleration[1] + lift[1], acceleration[2] + lift[2])
    # The yaw axis is the plane's z: W' = base's + theta1'' z + W_base x theta1' z (thesis, eq.
    # 2.40).
    return _Plane(lift, a, (w1, w2 + rate, w3), (d1 - rate * w3, d2 + accel, d3 + rate * w1), False)


_Turn = tuple[Value, Value, Value, Value]
"""How a link at an angle turns in the arm's plane: cosine, sine, rate and acceleration. A plain
tuple, because a single state makes few others."""


def _turns(g: Geometry, state: _State) -> tuple[tuple[_Turn, ...], Loop | None]:
    """Return the turning of each pair of _LINKS, and the loop unless it is a parallelogram.

    Raises:
        InfeasibleError: the linkage cannot close.
    """
    (_, q2, q3, _, q5), (_, qd2, qd3, _, qd5), (_, qdd2, qdd3, _, qdd5) = state
    (c2, s2), (c3, s3) = cosine_and_sine(q2), cosine_and_sine(q3)
    inner, lower = (c2, s2, qd2, qdd2), (c3, s3, qd3, qdd3)
    if g.is_parallelogram:
        c, s = cosine_and_sine(q3 + q5)
        return (inner, lower, (c, s, qd3 + qd5, qdd3 + qdd5)), None
    loop = solved_loop(g, (c2, s2), (c3, s3))
    rates, accels = loop.rates(qd2, qd3), loop.accelerations((qd2, qd3), qdd2, qdd3)
    (cu, su), (c, s) = loop.upper, cosine_and_sine(q5)
    tool = (cu * c - su * s, su * c + cu * s, rates[0] + qd5, accels[0] + qdd5)
    return (inner, (cu, su, rates[0], accels[0]), tool, lower, (*loop.outer, rates[1], accels[1])), loop


def _accelerations(state: _State, plane: _Plane, links: Sequence[_Turn], rho: Value) -> _Rows:
    """Return A, the acceleration of each vector b, along x, z and n.

    It is an array (3, m, n), or three lists for a single state.
    """
    count = 5 + 2 * len(links)
    A: Any = [[0.0] * count for _ in range(3)] if isinstance(rho, float) else np.empty((3, count, *rho.shape))
    Ax, Az, An = A
    if plane.level:
        _fill_level(A, plane, links)
    else:
        _fill_moving(A, plane, links)
    (c, s, rate, _), slide = links[1], 2.0 * state.qd[3]
    turning = slide * (rate + plane.W[2])
    Ax[_RHO] = rho * Ax[_E3] + (state.qdd[3] * c - turning * s)
    Az[_RHO] = rho * Az[_E3] + (state.qdd[3] * s + turning * c)
    across = plane.W[1] * c if plane.level else plane.W[1] * c - plane.W[0] * s
    An[_RHO] = rho * An[_E3] - slide * across
    rows: _Rows = A
    return rows


def _fill_level(A: Any, plane: _Plane, links: Sequence[_Turn]) -> None:
    """Fill A but for rho e3 with a base at rest: the plane turns about z alone."""
    Ax, Az, An = A
    w, d = plane.W[1], plane.W1[1]
    square = w * w
    Ax[_O], Az[_O], An[_O] = plane.a
    Ax[_X], Az[_X], An[_X] = -square, 0.0, -d
    Ax[_Z], Az[_Z], An[_Z] = 0.0, 0.0, 0.0
    Ax[_N], Az[_N], An[_N] = d, 0.0, -square
    for (e, p), (c, s, rate, accel) in zip(_LINKS, links, strict=False):
        along_z = rate * rate
        along_x, m = along_z + square, 2.0 * rate * w
        Ax[e] = -along_x * c - accel * s
        Az[e] = accel * c - along_z * s
        An[e] = m * s - d * c
        Ax[p] = along_x * s - accel * c
        Az[p] = -accel * s - along_z * c
        An[p] = m * c + d * s


def _fill_moving(A: Any, plane: _Plane, links: Sequence[_Turn]) -> None:
    """Fill A but for rho e3."""
    Ax, Az, An = A
    w1, w2, w3 = plane.W
    d1, d2, d3 = plane.W1
    w11, w22, w33, w12, w13, w23 = w1 * w1, w2 * w2, w3 * w3, w1 * w2, w1 * w3, w2 * w3
    Ax[_O], Az[_O], An[_O] = plane.a
    Ax[_X], Az[_X], An[_X] = -(w22 + w33), w12 + d3, w13 - d2
    Ax[_Z], Az[_Z], An[_Z] = w12 - d3, -(w11 + w33), w23 + d1
    Ax[_N], Az[_N], An[_N] = w13 + d2, w23 - d1, -(w11 + w22)
    for (e, p), (c, s, rate, accel) in zip(_LINKS, links, strict=False):
        total, double = rate + w3, 2.0 * rate
        square = total * total
        along_x, along_z = square + w22, square + w11
        less, more = accel + d3 - w12, accel + d3 + w12
        k, m = double * w1 + w13 - d2, double * w2 + w23 + d1
        Ax[e] = -along_x * c - less * s
        Az[e] = more * c - along_z * s
        An[e] = k * c + m * s
        Ax[p] = along_x * s - less * c
        Az[p] = -more * s - along_z * c
        An[p] = m * c - k * s


def _torques(
    rho: Value, links: Sequence[_Turn], loop: Loop | None, U: Any, moment: _Vector
) -> tuple[tuple[Value, ...], Value, Value]:
    """Return joint torques, the moment about the actuator's pin, and the torque in the plane.

    The moment is that of all bodies beyond the actuator. The torque in the plane is the sum of the
    torques on all links in the arm's plane. U is along x, z and n.
    """
    Ux, Uz, Un = U
    (c2, s2, _, _), (c3, s3, _, _), (ct, st, _, _) = links[:3]
    on_tool = ct * (Uz[_ET] - Ux[_PT]) - st * (Ux[_ET] + Uz[_PT]) - moment[2]
    beyond_actuator = rho * (c3 * Uz[_RHO] - s3 * Ux[_RHO]) + on_tool
    # x and z of the vectors b, less those of the base itself, for moments that need all of the boom
    reach = (c2 * Un[_E2] - s2 * Un[_P2]) + (c3 * Un[_E3] - s3 * Un[_P3]) + rho * c3 * Un[_RHO] + (ct * Un[_ET] - st * Un[_PT])
    tau_2 = c2 * (Uz[_E2] - Ux[_P2]) - s2 * (Ux[_E2] + Uz[_P2])
    tau_3 = c3 * (Uz[_E3] - Ux[_P3]) - s3 * (Ux[_E3] + Uz[_P3]) + beyond_actuator
    in_plane = tau_2 + tau_3
    if loop is not None:
        for (e, p), (c, s, _, _) in zip(_LINKS[3:], links[3:], strict=True):
            reach = reach + (c * Un[e] - s * Un[p])
        at_psi, lower, outer = tau_3, _about(links[3], Ux, Uz, _EL, _PL), _about(links[4], Ux, Uz, _EO, _PO)
        in_plane = in_plane + lower + outer
        tau_2 = tau_2 + loop.upper_by[0] * at_psi + loop.outer_by[0] * outer
        tau_3 = lower + loop.upper_by[1] * at_psi + loop.outer_by[1] * outer
    tau_1 = Ux[_N] - Un[_X] - reach - moment[1]
    tau_4 = c3 * Ux[_RHO] + s3 * Uz[_RHO]
    return (tau_1, tau_2, tau_3, tau_4, on_tool), beyond_actuator, in_plane


def _about(link: _Turn, Ux: Sequence[Value], Uz: Sequence[Value], e: int, p: int) -> Value:
    """Return (b_e x U_e + b_p x U_p) . n."""
    c, s, _, _ = link
    turned: Value = c * (Uz[e] - Ux[p]) - s * (Ux[e] + Uz[p])
    return turned


def _single(boom: Boom, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array | None:
    """Return the torques (5,) of one state on level ground, without the preparations for many.

    None for other inputs than three finite arrays (5,).
    """
    numbers = []
    for x in (q, qd, qdd):
        if type(x) is not np.ndarray or x.shape != _ONE or x.dtype != np.float64:
            return None
        numbers.append(x.tolist())
    state = _State(*numbers)
    if not isfinite(sum(state.q) + sum(state.qd) + sum(state.qdd)):
        return None
    rho, (links, loop) = boom.geometry.L7 + state.q[3], _turns(boom.geometry, state)
    x, z, n = _accelerations(state, _plane(boom, state), links, rho)
    U = np.array(x + z + n).reshape(3, len(x)).dot(regrouped(boom, "mass").torque_rows.T).tolist()
    return np.array(_torques(rho, links, loop, U, _NOTHING)[0])


def _newton_euler(
    model: Regrouped, state: _State, plane: _Plane, force: _Vector | None, moment: _Vector | None, out: _Outputs
) -> None:
    """Fill the outputs of a chunk, with a force and a moment on the tip."""
    g, q = model.boom.geometry, state.q
    rho, (links, loop), count = g.L7 + q[3], _turns(g, state), _count(g)
    A = _accelerations(state, plane, links, rho)
    rows = model.rows if out.pins is not None else model.torque_rows
    U = np.array(A[0] + A[1] + A[2]).reshape(3, count).dot(rows.T) if isinstance(A, list) else rows @ A
    if model.hanging:
        _put_on(
            U, model.payload, (-model.hanging * plane.lift[0], -model.hanging * plane.lift[1], -model.hanging * plane.lift[2])
        )
    if force is not None:
        _put_on(U, model.tip, force)
    moment = _NOTHING if moment is None else moment
    U = U.tolist() if isinstance(A, list) else U
    Ux, Uz, Un = U
    tau, beyond_actuator, in_plane = _torques(rho, links, loop, U, moment)
    if isinstance(A, list):
        out.tau[0] = tau
    else:
        for row, part in zip(out.tau.T, tau, strict=True):
            row[:] = part
    if out.pins is None or out.mount is None:
        return

    # Pin 7 lies L5 along the upper link's direction from pin 8, and L4 along the outer link's from
    # pin 6: the moments about pins 8 and 6 give the force at pin 7 across both directions, and the
    # balance of forces the other two.
    outer_link = links[0] if loop is None else links[4]
    (c3, s3, _, _), (c4, s4, _, _) = links[1], outer_link
    M_outer = _about(outer_link, Ux, Uz, count + 1, count + 2)
    M_top = _about(links[1], Ux, Uz, count + 4, count + 5) + beyond_actuator
    sine = s3 * c4 - c3 * s4
    with np.errstate(divide="ignore", invalid="ignore"):
        along_outer, along_upper = np.divide(-M_top, g.L5 * sine), np.divide(-M_outer, g.L4 * sine)
        f7x, f7z = along_outer * c4 + along_upper * c3, along_outer * s4 + along_upper * s3
    forces = ((Ux[count] + f7x, Uz[count] + f7z), (f7x, f7z), (Ux[count + 3] - f7x, Uz[count + 3] - f7z))
    for pin, (x, z) in enumerate(forces):
        out.pins[pin, :, 0], out.pins[pin, :, 2] = x, z

    rise = rho * s3 * Un[_RHO]
    for (e, p), (c, s, _, _) in zip(_LINKS, links, strict=False):
        rise = rise + (s * Un[e] + c * Un[p])
    Mx = Un[_Z] - Uz[_N] + rise - moment[0]
    Mn = Uz[_X] - Ux[_Z] + in_plane
    c1, s1 = cosine_and_sine(q[0])
    mount = out.mount
    for row, along, normal in ((0, Ux[_O], Un[_O]), (3, Mx, Mn)):
        mount[:, row] = -(c1 * along + s1 * normal)
        mount[:, row + 1] = -(s1 * along - c1 * normal)
    mount[:, 2] = -Uz[_O]
    mount[:, 5] = -tau[0]


def _put_on(U: Array, g: Array, force: _Vector) -> None:
    """Take a force at the point g off what the bodies need, in place."""
    count = len(g)
    for row, along in zip(U, force, strict=True):
        taken = np.multiply.outer(g, along)
        taken = taken if taken.ndim == row.ndim else taken[:, None]  # the same force in every state
        row[:count] -= taken
        if len(row) > count:
            row[count + 3 :] -= taken[[_O, _E3, _P3]]
