"""Shapes to keep away from: distances by convex search in place of a collision library, detours,
refusals, the file's table."""

import sys

import numpy as np
import pytest

from boom_model import Basis, Boom, InfeasibleError, InputError
from boom_model.boom_file import BOOM_FILE
from boom_model.keep_out import Box, Capsule
from planner import Cubic, TipTarget, plan
from planner.paths.clearance import LINKS, clearance, least_clearance
from planner.paths.path import JointLine, through
from planner.paths.routing import detour
from tests.builders import ORIGIN, POST, ROUND_POST, with_shapes

BOOM = Boom.load()
LIMITS = BOOM.limits
GROUND = Box("ground", np.array([0.0, 0.0, -1.5]), np.array([20.0, 20.0, 1.0]), ORIGIN)


def lines(q):
    """Both ends of each link (..., 7, 2, 3), from the plane geometry of the linkage (thesis, figure
    2-1)."""
    g = BOOM.geometry
    yaw, inner, lower, extension, wrist = np.moveaxis(np.asarray(q), -1, 0)

    def along(angle, length):
        return length * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    shoulder = np.broadcast_to([g.L2, g.L1], (*yaw.shape, 2))
    elbow = shoulder + along(lower, g.L3)
    far = elbow + along(inner, g.L4)
    upper = shoulder + along(inner, g.L4)
    hand = upper + along(lower - np.pi / 2.0, g.L6) - along(lower, 1.0) * (g.L7 + extension)[..., None]
    tip = hand + along(lower + wrist + np.pi / 2.0, g.L8)
    pairs = [(shoulder, elbow), (elbow, far), (far, upper), (shoulder, upper), (upper, hand), (hand, tip), (tip, tip)]
    plane = np.stack([np.stack(pair, axis=-2) for pair in pairs], axis=-3)
    r, z, turn = plane[..., 0], plane[..., 1], yaw[..., None, None]
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)


def from_point(shape, p):
    """Distance of points (..., 3) to a shape, 0 inside a box, a capsule's negative inside."""
    if isinstance(shape, Box):
        return np.linalg.norm(np.maximum(np.abs(p - shape.center) - shape.size / 2.0, 0.0), axis=-1)
    axis = shape.end - shape.start
    share = np.clip((p - shape.start) @ axis / max(axis @ axis, 1e-300), 0.0, 1.0)
    return np.linalg.norm(p - shape.start - share[..., None] * axis, axis=-1) - shape.radius


def distances(boom, q):
    """(..., 7, shapes): the distance from a point that runs along a link is convex in its place, so
    a ternary search finds the least."""
    ends, keep = lines(q), boom.keep_out
    found = []
    for shape in keep.shapes:
        low, high = np.zeros(ends.shape[:-2]), np.ones(ends.shape[:-2])

        def at(share, ends=ends, shape=shape):
            return from_point(shape, ends[..., 0, :] + share[..., None] * (ends[..., 1, :] - ends[..., 0, :]))

        for _ in range(40):
            a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
            nearer = at(a) < at(b)
            low, high = np.where(nearer, low, a), np.where(nearer, b, high)
        thick = np.array([keep.payload_radius if link == "payload" else keep.link_radius for link in LINKS])
        found.append(at((low + high) / 2.0) - thick)
    return np.stack(found, axis=-1)


def random_shape(rng, name):
    place = rng.uniform([-2.5, -2.5, -1.5], [2.5, 2.5, 2.0])
    if rng.random() < 0.5:
        return Box(name, place, rng.uniform(0.02, 1.0, 3), ORIGIN)
    return Capsule(name, place, place + rng.uniform(-1.0, 1.0, 3), rng.uniform(0.005, 0.3), ORIGIN)


def test_distances_are_those_of_a_convex_search():
    rng = np.random.default_rng(8)
    apart = 0
    for _ in range(200):
        boom = with_shapes(random_shape(rng, "one"), random_shape(rng, "two"), link_radius=rng.uniform(0.01, 0.1))
        q = rng.uniform(LIMITS.lower, LIMITS.upper)
        expected, found = distances(boom, q), clearance(boom, q)
        if expected.min() > 0.0:
            apart += 1
            assert found.distance == pytest.approx(expected.min(), abs=2e-6)
        else:
            assert found.distance <= 1e-6
            continue
        link, shape = LINKS.index(found.link), ["one", "two"].index(found.shape)
        assert expected[link, shape] == pytest.approx(expected.min(), abs=4e-6)
    assert apart > 120


def test_nothing_thin_is_missed_on_the_way():
    """A wire of 2 cm between two looks of the coarsest grid."""
    rng = np.random.default_rng(9)
    run_into = 0
    for _ in range(20):
        start, goal = (np.array([rng.uniform(0.0, 6.0), 0.5, 2.2, rng.uniform(0.0, 1.0), 0.0]) for _ in range(2))
        place = lines(start + rng.uniform(0.1, 0.9) * (goal - start))[5, 1] + rng.normal(0.0, 0.15, 3)
        half = np.array([0.0, 0.0, 0.5])
        wire = Capsule("wire", place - half, place + half, 0.01, ORIGIN)
        boom = with_shapes(wire, clearance=0.02, link_radius=0.02, payload_radius=0.04)
        path = JointLine(start, goal)
        truly = distances(boom, path(np.linspace(0.0, 1.0, 3001))).min()
        found = least_clearance(boom, path)
        run_into += truly < 0.02
        if truly < 0.019:
            assert found.distance == pytest.approx(truly, abs=1e-3)
        elif truly > 0.021:  # how near exactly is then looked for to a centimetre
            assert truly - 1e-3 <= found.distance <= truly + 0.011
    assert 4 < run_into < 20


@pytest.mark.parametrize("profile", ["cubic", "time-optimal"])
def test_a_detour_keeps_clear_and_within_the_limits(profile):
    boom = with_shapes(GROUND, POST)
    start, goal = ROUND_POST
    assert distances(boom, JointLine(start, goal)(np.linspace(0.0, 1.0, 501))).min() < 0.0
    move = plan(boom, start, goal, profile=profile)
    assert len(move.motions) > 1
    for motion in move.motions:
        q = motion(np.linspace(0.0, motion.duration, 1001))[0]
        assert distances(boom, q).min() >= 0.05 - 1e-3
        assert LIMITS.contain(q).all()
    np.testing.assert_allclose(move.trajectory.q[[0, -1]], [start, goal], rtol=0, atol=1e-13)
    notes = [note for note in move.report.notes if note.startswith("detour around the shapes to keep away from")]
    assert len(notes) == len(move.motions) - 1
    stops = np.cumsum([motion.duration for motion in move.motions])[:-1]
    q, qd, *_ = move.motions[0](stops[0])
    np.testing.assert_allclose(qd, 0.0, atol=1e-9)
    assert f"yaw {np.degrees(q[0]):.1f} deg" in notes[0]


def test_a_detour_is_the_same_each_time():
    boom = with_shapes(GROUND, POST)
    np.testing.assert_array_equal(detour(boom, *ROUND_POST), detour(boom, *ROUND_POST))


def test_a_pose_too_near_to_a_shape_is_refused_with_link_shape_and_distance():
    near = with_shapes(Box("shed", np.array([2.2, 0.0, 0.5]), np.array([1.0, 1.0, 1.0]), ORIGIN))
    goal = np.array([0.0, 1.0, np.pi, 0.2, 0.0])
    expected = distances(near, goal)
    link, _ = np.unravel_index(int(np.argmin(expected)), expected.shape)
    start = np.array([3.0, 1.0, np.pi, 0.2, 0.0])
    how = "runs into" if expected.min() <= 0 else f"comes within {expected.min() * 1e3:.0f} mm of"
    for options in ({}, {"via": [goal], "stop_at_via": True}):
        target = start if options else goal
        sentence = f"target 2: the {LINKS[link]} {how} the shed; the required clearance is 50 mm"
        with pytest.raises(InfeasibleError, match=sentence):
            plan(near, start, target, **options)
    barely = with_shapes(Box("shed", np.array([10.0, 0.0, 0.5]), np.array([1.0, 1.0, 1.0]), ORIGIN))
    gap = float(distances(barely, goal).min())
    shed = Box("shed", np.array([10.0 - gap + 0.03, 0.0, 0.5]), np.array([1.0, 1.0, 1.0]), ORIGIN)
    with pytest.raises(InfeasibleError, match="comes within 30 mm of the shed; the required clearance is 50 mm"):
        plan(with_shapes(shed), start, goal)


def test_no_way_round_is_refused_with_what_is_in_the_way():
    """A lane between two walls of any height, one side of the vehicle to be reached
    from the other."""
    walls = [Box(f"wall {k}", np.array([x, 0.0, 0.0]), np.array([4.0, 3.0, 20.0]), ORIGIN) for k, x in enumerate((2.25, -2.25))]
    start, goal = (np.array([yaw, 0.5, 2.6, 0.3, 0.0]) for yaw in (np.pi / 2.0, 3.0 * np.pi / 2.0))
    sentence = r"no detour was found; at \d+\.\d% of the straight joint move the .* wall 1; the required clearance is 50 mm"
    with pytest.raises(InfeasibleError, match=sentence):
        plan(with_shapes(*walls), start, goal)


def test_other_paths_are_refused_and_not_led_round():
    boom = with_shapes(POST)
    via = (ROUND_POST[0] + ROUND_POST[1]) / 2.0
    clear = ROUND_POST[0] + np.array([0.1, 0.0, 0.0, 0.1, 0.0])
    path = through(boom, np.array([ROUND_POST[0], clear, ROUND_POST[1]]))
    assert distances(boom, path(np.linspace(0.0, 1.0, 501))).min() < 0.05
    sentence = r"at \d+\.\d% of the path the .* post; the required clearance is 50 mm; detours are planned for straight"
    with pytest.raises(InfeasibleError, match=sentence):
        plan(boom, *ROUND_POST, profile="quintic", via=[clear], stop_at_via=False)
    with pytest.raises(InfeasibleError, match=r"target 2: the .* post"):
        plan(boom, *ROUND_POST, profile="quintic", via=[via], stop_at_via=False)
    across = TipTarget((2.0, 0.8, 0.5)), TipTarget((0.8, 2.0, 0.5))
    plan(BOOM, *across, along="line")
    with pytest.raises(InfeasibleError, match=r"of the path the .* runs into the post.*; detours are planned for straight"):
        plan(boom, *across, along="line")


def test_cubics_through_waypoints_are_held_clear_on_their_own_path_and_not_on_the_spline_that_they_replace():
    start, via, goal = BOOM.pose("transport"), np.array([0.7, 0.5, 2.0, 0.4, -0.2]), BOOM.pose("phenotyping")
    velocities = [[0.0, 0.3, 0.0, -0.25, 0.0]]
    (motion,) = plan(BOOM, start, goal, via=[via], profile=Cubic.with_velocities(velocities)).motions
    travelled = motion(np.linspace(0.0, motion.duration, 401))[0]
    looked_at = through(BOOM, np.array([start, via, goal]))(np.linspace(0.0, 1.0, 601))
    options = {"clearance": 0.01, "link_radius": 0.01, "payload_radius": 0.01}
    best = None
    for place in lines(travelled)[::20, 5, 1]:
        boom = with_shapes(Capsule("ball", place, place, 0.01, ORIGIN), **options)
        ahead = distances(boom, looked_at).min()
        if best is None or ahead > best[0]:
            best = ahead, boom
    ahead, boom = best
    assert ahead > 0.02  # the spline keeps clear of it
    assert distances(boom, travelled).min() < 0.0  # the cubics run into it
    with pytest.raises(InfeasibleError, match=r"of the path the .* runs into the ball"):
        plan(boom, start, goal, via=[via], profile=Cubic.with_velocities(velocities))


@pytest.mark.parametrize("profile", ["cubic", "jerk-limited"])
def test_nothing_changes_without_shapes_or_with_shapes_out_of_the_way(profile):
    far = with_shapes(Box("barn", np.array([30.0, 0.0, 0.0]), np.ones(3), ORIGIN))
    assert BOOM.keep_out is None
    plain, with_barn = (plan(boom, "transport", "phenotyping", profile=profile) for boom in (BOOM, far))
    np.testing.assert_array_equal(plain.trajectory.q, with_barn.trajectory.q)
    assert plain.report.notes == with_barn.report.notes


@pytest.fixture
def without_coal(monkeypatch):
    monkeypatch.setitem(sys.modules, "coal", None)


@pytest.mark.usefixtures("without_coal")
def test_without_coal_shapes_name_the_extra_that_they_need(boom, tmp_path):
    (tmp_path / "mine.toml").write_text(BOOM_FILE.read_text() + TABLE + BOX)
    code, _, complaint = boom("plan", "transport", "phenotyping", "--boom", "mine.toml")
    assert code == 2
    assert complaint.count("\n") == 1
    assert "pip install '.[keep-out]'" in complaint
    assert [file.name for file in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.usefixtures("without_coal")
def test_without_coal_all_else_works(boom, tmp_path):
    assert boom("plan", "transport", "phenotyping", "--csv", "move.csv")[0] == 0
    (tmp_path / "mine.toml").write_text(BOOM_FILE.read_text() + TABLE + BOX)
    assert boom("torque", "move.csv", "--out", "torques.csv", "--boom", "mine.toml")[0] == 0
    code, _, complaint = boom("check", "move.csv", "--boom", "mine.toml")
    assert (code, "extra keep-out" in complaint) == (2, True)


TABLE = """
[keep_out]
clearance_m = 0.05
link_radius_m = 0.06
payload_radius_m = 0.15
basis = "assumed"
source = "a test"
"""
BOX = """
[[keep_out.box]]
name = "ground"
center_m = [0, 0, -1.5]
size_m = [20, 20, 1]
basis = "assumed"
source = "level field"
"""
CAPSULE = """
[[keep_out.capsule]]
name = "post"
start_m = [1, 1, -1]
end_m = [1, 1, 0.6]
radius_m = 0.1
basis = "printed"
source = "drawing"
"""


@pytest.fixture
def load(tmp_path):
    def read(text):
        file = tmp_path / "mine.toml"
        file.write_text(BOOM_FILE.read_text() + text)
        return Boom.load(file)

    return read


def test_table_of_a_boom_file_is_read_with_its_origins(load):
    keep = load(TABLE + BOX + CAPSULE).keep_out
    assert (keep.clearance, keep.link_radius, keep.payload_radius) == (0.05, 0.06, 0.15)
    assert [shape.name for shape in keep.shapes] == ["ground", "post"]
    box, capsule = keep.shapes
    np.testing.assert_array_equal([box.center, box.size], [[0, 0, -1.5], [20, 20, 1]])
    np.testing.assert_array_equal([capsule.start, capsule.end], [[1, 1, -1], [1, 1, 0.6]])
    assert capsule.radius == 0.1
    assert (box.origin.basis, capsule.origin.basis, capsule.origin.source) == (Basis.ASSUMED, Basis.PRINTED, "drawing")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TABLE, "keep_out.*no box and no capsule is given"),
        (TABLE + BOX + BOX, "keep_out.*two shapes are named ground"),
        (TABLE + BOX + CAPSULE.replace('"post"', '"ground"'), "keep_out.*two shapes are named ground"),
        (TABLE + BOX.replace("20, 20, 1]", "20, -20, 1]"), r"keep_out\.box.*size_m.*-20"),
        (TABLE + BOX.replace("20, 20, 1]", "20, 20]"), r"keep_out\.box.*size_m"),
        (TABLE + BOX.replace("-1.5", "nan"), r"keep_out\.box.*center_m.*nan"),
        (TABLE + CAPSULE.replace("radius_m = 0.1", "radius_m = 0"), r"keep_out\.capsule.*radius_m"),
        (TABLE + CAPSULE.replace("end_m", "stop_m"), r"keep_out\.capsule.*(end_m|stop_m)"),
        (TABLE + BOX.replace('basis = "assumed"\n', ""), r"keep_out\.box.*basis is missing"),
        (TABLE.replace('basis = "assumed"\n', "") + BOX, r"keep_out\.basis is missing"),
        (TABLE.replace("0.05", "-0.05") + BOX, r"keep_out\.clearance_m.*-0\.05"),
        (TABLE.replace("link_radius_m = 0.06\n", "") + BOX, r"keep_out\.link_radius_m is missing"),
        (TABLE + BOX + "yaw = 3\n", r"keep_out\.box.*yaw"),
    ],
)
def test_bad_tables_are_named(load, text, message):
    with pytest.raises(InputError, match=message) as caught:
        load(text)
    assert "mine.toml" in str(caught.value)
