"""Lines and arcs of the tip: their geometry, the joint paths that follow them, and the moves
planned along them."""

import re

import numpy as np
import pytest

from boom_model.arrays import Array
from boom_model.boom import Boom
from boom_model.drives.drive import reflected_inertia
from boom_model.drives.limits import motor_limits, rotors
from boom_model.dynamics.newton_euler import inverse_dynamics
from boom_model.errors import InfeasibleError, InputError
from boom_model.kinematics.constraints import (
    ActuatorAngle,
    ActuatorHorizontal,
    FixedExtension,
    LargestMargin,
    LeastExtension,
    LeastTorque,
    NearestHorizontal,
    NearestPose,
)
from boom_model.kinematics.forward import forward_kinematics
from boom_model.kinematics.inverse import inverse_kinematics
from planner import TipTarget, plan
from planner.motion.trajectory import sample
from planner.paths.tip_curves import TipArc, TipLine
from planner.paths.tip_path import TipPath, follow
from planner.timing.path_limits import path_dynamics
from planner.timing.profile import SHORTEST

BOOM = Boom.load()
LIMITS = BOOM.limits
DOWN = -np.pi / 2
SLACK = 1.001


def line(start: tuple[float, float, float], goal: tuple[float, float, float]) -> TipLine:
    return TipLine(np.array(start, dtype=float), np.array(goal, dtype=float))


SWEEP = line((-1.0, 1.4, 1.0), (1.0, 1.4, 1.0))  # 2 m over a plot
RISE = line((0.9, 1.1, 0.95), (0.5, 1.4, 1.0))
ARC = TipArc.through((-0.4, 1.4, 0.9), (0.0, 1.6, 1.0), (0.4, 1.4, 0.9))
CONSTRAINTS = (
    ActuatorHorizontal(),
    ActuatorAngle(-0.05),
    FixedExtension(0.5),
    LeastTorque(),
    LargestMargin(),
    NearestPose.to((1.5, 1.0, 2.8, 0.5, 0.0)),
    LeastExtension(),
)


def circle(center: Array, first: Array, second: Array, radius: float, angle: float) -> Array:
    return center + radius * (np.cos(angle) * first + np.sin(angle) * second)


@pytest.mark.parametrize("whole", [0.3, 1.5, np.pi, 4.0, 6.0])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_an_arc_goes_through_its_three_points_the_right_way_round(whole, part):
    rng = np.random.default_rng(31)
    first, second, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    center, radius = rng.uniform(-1.0, 1.0, 3), 0.7
    for way in (second, -second):
        start, via, goal = (circle(center, first, way, radius, x) for x in (0.0, part * whole, whole))
        arc = TipArc.through(start, via, goal)
        np.testing.assert_allclose(arc(np.array([0.0, part, 1.0])), [start, via, goal], rtol=0, atol=1e-13)
        np.testing.assert_allclose(arc.center, center, rtol=0, atol=1e-13)
        assert arc.angle == pytest.approx(whole, abs=1e-13)
        assert arc.length == pytest.approx(radius * whole, abs=1e-13)
        s = np.linspace(0.0, 1.0, 1001)
        np.testing.assert_allclose(np.linalg.norm(arc(s) - arc.center, axis=-1), radius, rtol=1e-13)
        np.testing.assert_allclose(arc(s), [circle(center, first, way, radius, x * whole) for x in s], rtol=0, atol=1e-13)
        steps = np.linalg.norm(np.diff(arc(s), axis=0), axis=-1)
        np.testing.assert_allclose(steps, steps[0], rtol=1e-11)


@pytest.mark.parametrize("via", [(0.5, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (0.5, 1e-9, 1.0)])
def test_an_arc_through_three_points_of_a_line_is_refused(via):
    with pytest.raises(InputError, match="lies on a line with start and goal; an arc needs three points of a circle"):
        TipArc.through((0.0, 0.0, 1.0), via, (1.0, 0.0, 1.0))


def test_a_line_is_straight_at_constant_speed():
    s = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(SWEEP(s), np.stack([2 * s - 1, np.full(11, 1.4), np.ones(11)], axis=-1), rtol=0, atol=1e-15)
    assert SWEEP.length == pytest.approx(2.0, rel=1e-15)


def off_the_line(points: Array, curve: TipLine) -> Array:
    """Distance (n,) of points (n, 3) from the segment itself, wherever on it."""
    along = curve.goal - curve.start
    share = np.clip((points - curve.start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(points - curve.start - share[:, None] * along, axis=-1)


def off_the_circle(points: Array, arc: TipArc) -> Array:
    """Distance (n,) of points (n, 3) from the circle that the arc is a part of."""
    across = (points - arc.center) @ np.cross(arc.first, arc.second)
    in_plane = np.sqrt(((points - arc.center) ** 2).sum(axis=-1) - across**2)
    return np.hypot(in_plane - arc.radius, across)


@pytest.mark.parametrize("constraint", CONSTRAINTS, ids=lambda constraint: type(constraint).__name__)
@pytest.mark.parametrize(("curve", "pitch"), [(SWEEP, DOWN), (RISE, -1.2), (ARC, DOWN)], ids=["sweep", "rise", "arc"])
def test_the_tip_stays_on_its_curve_at_its_pitch_within_limits(constraint, curve, pitch):
    path = follow(BOOM, curve, pitch, constraint)
    s = np.linspace(0.0, 1.0, 10_000)
    q = path(s)
    tip = forward_kinematics(BOOM, q)
    off = off_the_line(tip.position, curve) if isinstance(curve, TipLine) else off_the_circle(tip.position, curve)
    assert off.max() < 5e-6  # of the 1e-5 that a path may leave its curve by
    assert np.linalg.norm(tip.position - curve(s), axis=-1).max() < 5e-6
    np.testing.assert_allclose(tip.pitch, pitch, rtol=0, atol=2e-14)
    assert LIMITS.contain(q).all()
    assert (np.abs(np.diff(q, axis=0)) / (LIMITS.upper - LIMITS.lower)).max() < 1e-3  # one branch from end to end
    np.testing.assert_allclose(tip.position[[0, -1]], curve(s[[0, -1]]), rtol=0, atol=1e-13)


@pytest.mark.parametrize("constraint", [ActuatorHorizontal(), FixedExtension(0.5)], ids=str)
def test_a_constraint_is_held_all_along(constraint):
    q = follow(BOOM, SWEEP, DOWN, constraint)(np.linspace(0.0, 1.0, 10_000))
    held = q[:, 3] - 0.5 if isinstance(constraint, FixedExtension) else q[:, 2] - np.pi
    assert np.abs(held).max() < 1e-12


@pytest.mark.parametrize("constraint", [*CONSTRAINTS[:3], CONSTRAINTS[5]], ids=lambda constraint: type(constraint).__name__)
@pytest.mark.parametrize("curve", [SWEEP, ARC], ids=["line", "arc"])
@pytest.mark.parametrize(("order", "tolerance"), [(1, 2e-9), (2, 1.5e-8), (3, 1e-6)])
def test_derivatives_of_a_tip_path_are_its_differences(constraint, curve, order, tolerance):
    path = follow(BOOM, curve, DOWN, constraint)
    s, h = np.linspace(0.01, 0.99, 197), 2e-6
    difference = (path(s + h, order - 1) - path(s - h, order - 1)) / (2 * h)
    exact = path(s, order)
    np.testing.assert_allclose(difference, exact, rtol=0, atol=tolerance * np.abs(exact).max())


def test_the_first_derivative_moves_the_tip_along_the_line():
    path, s = follow(BOOM, RISE, DOWN, ActuatorHorizontal()), np.linspace(0.0, 1.0, 101)
    h = 1e-6
    q, slope = path(s), path(s, 1)
    ahead, behind = (forward_kinematics(BOOM, q + way * h * slope).position for way in (1.0, -1.0))
    np.testing.assert_allclose((ahead - behind) / (2 * h), np.tile(RISE.goal - RISE.start, (101, 1)), rtol=0, atol=1e-7)


def test_the_deviation_that_a_path_tells_is_the_one_it_has():
    path = follow(BOOM, SWEEP, DOWN, ActuatorHorizontal(), tolerance=1e-3)
    s = np.linspace(0.0, 1.0, 10_001)
    off = np.linalg.norm(forward_kinematics(BOOM, path(s)).position - SWEEP(s), axis=-1).max()
    assert path.deviation == pytest.approx(off, rel=0.1)
    assert "line of 2 m to within" in path.sentence


def test_a_reference_chooses_the_branch_that_a_path_stays_on():
    """At this height the actuator is horizontal with the inner link on either side of upright."""
    curve = line((1.2, 0.3, 1.05), (1.35, 0.4, 1.05))
    paths = {
        side: follow(BOOM, curve, DOWN, ActuatorHorizontal(), reference=(0.3, theta2, np.pi, extension, 0.0))
        for side, theta2, extension in ((1.0, 1.2, 0.1), (-1.0, 1.9, 0.8))
    }
    for side, path in paths.items():
        assert (side * (np.pi / 2 - path(np.linspace(0.0, 1.0, 101))[:, 1]) > 0.1).all()


@pytest.mark.parametrize(
    "constraint",
    [
        *(
            constraint
            for constraint in CONSTRAINTS
            if not isinstance(constraint, ActuatorAngle) or constraint == ActuatorHorizontal()
        ),
        NearestHorizontal(),
    ],
    ids=lambda constraint: type(constraint).__name__,
)
def test_no_hold_flips_where_its_own_choice_could_go_on(constraint):
    follow(BOOM, line((1.2, 0.3, 1.05), (1.35, 0.4, 1.05)), DOWN, constraint)


@pytest.mark.parametrize(
    "constraint",
    [
        ActuatorHorizontal(),
        FixedExtension(0.5),
        LeastExtension(),
    ],
    ids=str,
)
def test_a_line_that_leaves_the_reach_names_where(constraint):
    """With the actuator horizontal the extension ends the reach: r = L2 + L9 cos(theta2) + L7 + 1
    m."""
    curve = line((1.4, 0.0, 1.0), (2.6, 0.0, 1.0))
    with pytest.raises(InfeasibleError, match="the tip's path leaves the workspace at") as caught:
        follow(BOOM, curve, DOWN, constraint)
    percent, x, y, z = re.search(r"at ([\d.]+)%, \(([^,]+), ([^,]+), ([^)]+)\) m", str(caught.value)).groups()
    inside, outside = 0.0, 1.0
    for _ in range(40):
        middle = (inside + outside) / 2
        within = inverse_kinematics(BOOM, curve(np.array(middle)), DOWN, constraint).best is not None
        inside, outside = (middle, outside) if within else (inside, middle)
    assert float(percent) == pytest.approx(100 * inside, abs=0.0051)
    np.testing.assert_allclose([float(x), float(y), float(z)], curve(np.array(inside)), rtol=0, atol=1.01e-3 * inside)
    if isinstance(constraint, ActuatorHorizontal):
        g = BOOM.geometry
        sine = (1.0 - g.L1 + g.L8 - g.L6) / g.L9
        assert float(x) == pytest.approx(g.L2 + g.L9 * np.sqrt(1 - sine**2) + g.L7 + 1.0, abs=1e-5)


def test_a_line_that_one_branch_can_follow_from_end_to_end_is_followed():
    """The branch nearest to the middle of the ranges runs out of extension at 42 %, the other one
    never."""
    constraint = ActuatorAngle(-0.05)
    curve = line((1.0, 1.1, 1.0), (0.6, 1.45, 0.95))
    follow(BOOM, curve, -1.2, constraint, reference=(0.83, 1.22, 3.09, 0.34, 0.42))
    follow(BOOM, curve, -1.2, constraint)


def test_a_line_that_starts_out_of_reach_says_so():
    with pytest.raises(InfeasibleError, match=r"the tip's path starts out of reach: tip \(3, 0, 1\) m"):
        follow(BOOM, line((3.0, 0.0, 1.0), (1.4, 0.0, 1.0)), DOWN, ActuatorHorizontal())


@pytest.mark.parametrize("y", [0.3, -0.3])
def test_a_line_across_the_end_of_yaw_forces_a_flip(y):
    """Of 64 equal steps the 33rd is the first beyond y = 0 from below, and the 32nd, on it, is at 0
    deg from above."""
    with pytest.raises(InfeasibleError, match=r"forces a change of branch under constraint horizontal at 5[01]") as caught:
        follow(BOOM, line((1.4, y, 1.0), (1.4, -y, 1.0)), DOWN, ActuatorHorizontal())
    assert float(re.search(r"\(1.4, ([^,]+), 1\) m", str(caught.value))[1]) == pytest.approx(0.0, abs=0.6 / 64)


def at_the_drives(q: Array, qd: Array, qdd: Array) -> Array:
    """Torques (n, 5) at the drives' outputs, their own inertia included."""
    tau = inverse_dynamics(BOOM, q, qd, qdd, reactions=False).tau
    for i in (1, 2):
        drive = BOOM.drives[i]
        tau[:, i] += drive.gearbox.efficiency * reflected_inertia(drive) * qdd[:, i]
    return tau


def worst_ratios(motion) -> dict[str, float]:
    """Largest |demand| / limit, of velocity and acceleration by differences of finer samples."""
    fine = sample(motion, 0.002)
    middle = np.linspace(1e-3, motion.duration - 1e-3, 2000)
    h = 1e-5
    qd = (motion(middle + h)[0] - motion(middle - h)[0]) / (2 * h)
    np.testing.assert_allclose(qd, motion(middle)[1], rtol=0, atol=1e-6)
    tau = at_the_drives(fine.q, fine.qd, fine.qdd)
    return {
        "velocity": float(np.abs(fine.qd / LIMITS.velocity).max()),
        "acceleration": float(np.abs(fine.qdd / LIMITS.acceleration).max()),
        "torque": float(np.abs(tau / motor_limits(BOOM, fine.qd)).max()),
        "jerk": 0.0 if fine.qddd is None else float(np.abs(fine.qddd / LIMITS.jerk).max()),
    }


START, VIA, GOAL = TipTarget((-0.5, 1.4, 1.0)), TipTarget((0.0, 1.55, 0.9)), TipTarget((0.5, 1.4, 1.0))
ALONG = {
    "line": {"along": "line"},
    "arc": {"along": (0.0, 1.6, 1.0)},
    "polyline": {"along": "line", "via": [VIA]},
    "joint via": {"via": [VIA]},
}


@pytest.mark.parametrize("profile", SHORTEST)
@pytest.mark.parametrize("asked", ALONG.values(), ids=ALONG.keys())
def test_a_move_of_the_tip_keeps_every_limit_and_uses_one(profile, asked):
    move = plan(BOOM, START, GOAL, profile=profile, **asked)
    for motion in move.motions:
        ratios = worst_ratios(motion)
        assert max(ratios.values()) <= SLACK
        assert max(ratios.values()) > 0.9
        assert LIMITS.contain(sample(motion, 0.01).q).all()
    assert (move.motions[0].law.jerk_limited) == (profile == "jerk-limited")
    assert not [row for row in move.report.rows if row.verdict == "fail"]


@pytest.mark.parametrize("profile", SHORTEST)
@pytest.mark.parametrize("along", ["line", "joint"])
def test_a_move_stops_at_every_target_on_the_way(profile, along):
    second = TipTarget((0.3, 1.5, 0.9))
    move = plan(BOOM, START, GOAL, profile=profile, via=[VIA, second], along=along)
    assert len(move.motions) == 3
    stops = np.concatenate([[0.0], np.cumsum([motion.duration for motion in move.motions])])
    at = np.searchsorted(move.trajectory.t, stops - 1e-9)
    np.testing.assert_allclose(move.trajectory.t[at], stops, rtol=0, atol=1e-12)
    places = forward_kinematics(BOOM, move.trajectory.q[at]).position
    np.testing.assert_allclose(places, [t.position for t in (START, VIA, second, GOAL)], rtol=0, atol=1e-12)
    assert np.abs(move.trajectory.qd[at]).max() < 1e-12
    between = np.setdiff1d(np.arange(len(move.trajectory.t)), at)
    assert np.abs(move.trajectory.qd[between]).max(axis=-1).min() > 1e-6
    joints = np.diff(move.trajectory.q, axis=0)
    assert (np.abs(joints) <= LIMITS.velocity * SLACK * np.diff(move.trajectory.t)[:, None]).all()


@pytest.mark.parametrize("profile", SHORTEST)
@pytest.mark.parametrize("asked", [ALONG["arc"], ALONG["polyline"]], ids=["arc", "polyline"])
def test_a_given_duration_is_met(profile, asked):
    least = plan(BOOM, START, GOAL, profile=profile, step=0.1, **asked).report.duration
    move = plan(BOOM, START, GOAL, profile=profile, duration=1.5 * least, step=0.1, **asked)
    assert move.report.duration == pytest.approx(1.5 * least, rel=1e-12)
    with pytest.raises(InfeasibleError, match="is too short"):
        plan(BOOM, START, GOAL, profile=profile, duration=0.99 * least, step=0.1, **asked)


@pytest.mark.parametrize("profile", SHORTEST)
def test_the_two_metre_sweep_stays_within_a_tenth_of_a_millimetre(profile):
    move = plan(BOOM, TipTarget(tuple(SWEEP.start)), TipTarget(tuple(SWEEP.goal)), profile=profile, along="line")
    tip = forward_kinematics(BOOM, move.trajectory.q)
    assert off_the_line(tip.position, SWEEP).max() < 5e-10  # 1e-4 is asked for
    np.testing.assert_allclose(tip.pitch, DOWN, rtol=0, atol=2e-14)
    assert any("the tip follows a line of 2 m to within" in note for note in move.report.notes)


@pytest.mark.parametrize("profile", SHORTEST)
def test_an_arc_is_followed(profile):
    move = plan(BOOM, START, GOAL, profile=profile, along=(0.0, 1.6, 1.0))
    tip = forward_kinematics(BOOM, move.trajectory.q).position
    assert off_the_circle(tip, TipArc.through(START.position, (0.0, 1.6, 1.0), GOAL.position)).max() < 5e-9
    assert tip[:, 1].max() == pytest.approx(1.6, abs=1e-4)


def test_a_leg_goes_on_from_the_branch_of_the_one_before():
    """On its own the second leg would start on the other branch, which is nearer to the middle of
    the joints' ranges."""
    corner, goal = TipTarget((0.0, 1.2, 1.05)), TipTarget((-0.3, 1.15, 1.05))
    alone = plan(BOOM, corner, goal, along="line")
    move = plan(BOOM, TipTarget((0.0, 1.6, 1.05)), goal, via=[corner], along="line")
    first, second = (motion.path for motion in move.motions)
    assert abs(alone.trajectory.q[0, 1] - first(1.0)[1]) > 0.5
    np.testing.assert_allclose(second(0.0), first(1.0), rtol=0, atol=1e-13)


def test_a_leg_of_no_length_is_left_out():
    assert len(plan(BOOM, START, GOAL, via=[START, VIA], along="line").motions) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"along": (0.0, 1.6, 1.0), "via": [VIA]}, "an arc connects two tip targets; it takes no targets on the way"),
        ({"along": "line", "start": "transport"}, "'transport' is not a tip target"),
        ({"along": "line", "via": [(1.5, 1.0, 3.0, 0.3, 0.0)]}, "is not a tip target"),
        ({"along": "line", "pitch": None}, "has a constant pitch, which must be given"),
        ({"along": (0.0, 1.6, 1.0), "pitch": None}, "has a constant pitch, which must be given"),
        ({"along": "spiral"}, "unknown along 'spiral'; there are: joint, line, arc=X,Y,Z"),
        ({"along": (0.0, 1.4, 1.0)}, "lies on a line with start and goal"),
        ({"along": (0.0, np.nan, 1.0)}, r"via\[1\] is nan"),
        ({"along": (0.0, 1.0)}, "via has shape"),
        ({"along": "line", "pitch": np.nan}, "pitch is nan"),
    ],
)
def test_what_cannot_lead_a_tip_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        plan(BOOM, **({"start": START, "goal": GOAL} | arguments))


def test_the_planners_dynamics_are_the_booms_along_a_curved_path():
    """The path's derivatives enter the planner's dynamics in their places."""
    path: TipPath = follow(BOOM, RISE, DOWN, ActuatorHorizontal())
    s = np.linspace(0.0, 1.0, 21)
    demands, rate, gain = path_dynamics(BOOM, path, s), 0.3, 0.2
    q, p1, p2 = (path(s, order) for order in range(3))
    tau = at_the_drives(q, p1 * rate, p1 * gain + p2 * rate**2)
    driven = rotors(BOOM) * (demands.p1 * gain + demands.p2 * rate**2)
    np.testing.assert_allclose(demands.a * gain + demands.b * rate**2 + demands.c + driven, tau, rtol=0, atol=1e-11)
