"""Vehicle cases: their motion against differences of their own pose, and what they do to a plan and
its checks."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Basis, Boom, InputError, Origin, inverse_dynamics
from planner import Verdict, check, plan
from planner.motion.vehicle import LEVEL, VehicleCase, base_motion, base_pose, load_case, named_cases
from tests.builders import row_of

BOOM = Boom.load()
MADE_UP = Origin(Basis.ASSUMED, "made up")
ROUGH = VehicleCase("rough", MADE_UP, roll=0.2, pitch=-0.1, amplitude=0.3, wavelength=2.5, speed=1.7)
SLOPE = VehicleCase("slope", MADE_UP, roll=0.15, pitch=0.1)
SHOCK = VehicleCase("shock", MADE_UP, peak=30.0, shock_duration=0.2, shock_start=1.0)


def turning(R, R_rate):
    """Angular velocity along the moving axes, from R^T R'."""
    spin = np.swapaxes(R, -1, -2) @ R_rate
    return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def test_motion_is_the_derivative_of_the_pose():
    t, h = np.linspace(0.0, 4.0, 41), 1e-4
    before, now, after = (base_pose(ROUGH, t + shift) for shift in (-h, 0.0, h))
    R, motion = now[..., :3, :3], base_motion(ROUGH, t)
    place = [
        pose[..., :3, 3] + ROUGH.speed * (t + shift)[:, None] * [1.0, 0.0, 0.0]
        for pose, shift in ((before, -h), (now, 0.0), (after, h))
    ]
    along = lambda vectors: np.einsum("nji,nj->ni", R, vectors)  # noqa: E731
    np.testing.assert_allclose(motion.velocity, along((place[2] - place[0]) / (2 * h)), rtol=0, atol=1e-6)
    np.testing.assert_allclose(motion.acceleration, along((place[2] - 2 * place[1] + place[0]) / h**2), rtol=0, atol=1e-5)
    np.testing.assert_allclose(
        motion.angular_velocity, turning(R, (after[..., :3, :3] - before[..., :3, :3]) / (2 * h)), rtol=0, atol=1e-6
    )
    rate = (base_motion(ROUGH, t + h).angular_velocity - base_motion(ROUGH, t - h).angular_velocity) / (2 * h)
    np.testing.assert_allclose(motion.angular_acceleration, rate, rtol=0, atol=1e-5)
    np.testing.assert_allclose(motion.up, R[:, 2, :], rtol=0, atol=1e-15)


def test_pose_is_a_rotation_that_raises_the_nose_uphill():
    pose = base_pose(ROUGH, np.linspace(0.0, 4.0, 41))
    R = pose[..., :3, :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-15)
    uphill = base_pose(replace(ROUGH, roll=0.0, pitch=0.0), [0.0])[0]
    assert uphill[2, 0] > 0.5  # the track starts up its wave: the boom's forward axis points up


def test_shock_is_a_half_sine():
    motion = base_motion(SHOCK, [0.99, 1.0, 1.05, 1.1, 1.2, 1.21])
    np.testing.assert_allclose(motion.acceleration[:, 2], [0.0, 0.0, 30.0 * np.sin(np.pi / 4), 30.0, 0.0, 0.0], atol=1e-13)


def test_named_cases_are_marked_assumed_and_load():
    assert set(named_cases()) == {"ditch", "shock", "slope", "track"}
    for name in named_cases():
        case = load_case(name)
        assert case.name == name
        assert case.origin.basis is Basis.ASSUMED
    assert load_case("slope").is_steady
    assert not load_case("track").is_steady


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'x'", "key basis is missing"),
        ("name = 'x'\nbasis = 'assumed'\nsource = ''\n[slope]\nroll = 5", "key slope.roll is not known"),
        (
            "name = 'x'\nbasis = 'assumed'\nsource = ''\n[track]\namplitude_m = 1\nwavelength_m = 0\nspeed_m_s = 1",
            "track.wavelength_m",
        ),
        (
            "name = 'x'\nbasis = 'assumed'\nsource = ''\n[shock]\npeak_m_s2 = 1\nduration_s = 1\ndirection = [0, 0, 0]",
            "direction",
        ),
    ],
)
def test_bad_case_names_file_and_key(text, message, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_case(str(path))
    assert str(path) in str(caught.value)


def test_unknown_case_lists_those_there_are():
    known = "ditch, shock, slope, track"
    with pytest.raises(InputError, match=f"unknown vehicle case 'swamp'; there are: {known}, or a FILE"):
        load_case("swamp")


def test_static_rows_take_the_tilt_and_not_the_shock():
    q = BOOM.pose("phenotyping")
    still = plan(BOOM, q, q, vehicle=SLOPE).report
    tilted = inverse_dynamics(BOOM, q, np.zeros(5), np.zeros(5), base=base_motion(SLOPE, 0.0)).tau
    assert row_of(still, "yaw", "drive worst hold").demand == pytest.approx(abs(tilted[0]), rel=1e-12)
    assert abs(tilted[0]) > 10.0  # on level ground the yaw holds nothing
    calm, shaken = (plan(BOOM, "transport", "phenotyping", vehicle=v).report for v in (LEVEL, SHOCK))
    assert row_of(calm, "inner", "gearbox hold").demand == pytest.approx(
        row_of(shaken, "inner", "gearbox hold").demand, rel=1e-6
    )


def test_shock_is_held_against_the_momentary_peak_torque_alone():
    level, shaken = (plan(BOOM, "transport", "phenotyping", vehicle=v) for v in (LEVEL, SHOCK))
    assert not any(row.check == "gearbox momentary peak" for row in level.report.rows)
    momentary, repeated = (row_of(shaken.report, "inner", f"gearbox {name} peak") for name in ("momentary", "repeated"))
    base = base_motion(SHOCK, 1.1)
    q, qd, qdd, _ = shaken.motions[0](1.1)
    assert momentary.demand == pytest.approx(inverse_dynamics(BOOM, q, qd, qdd, base=base).tau[1], rel=3e-3)
    assert momentary.limit == 751.0
    assert momentary.verdict is Verdict.FAIL
    assert momentary.basis is Basis.ASSUMED
    assert repeated.demand == pytest.approx(row_of(level.report, "inner", "gearbox repeated peak").demand, rel=1e-6)
    assert repeated.verdict is Verdict.PASS


def test_a_case_says_how_often_its_shock_comes(tmp_path):
    """At 2.5 s joint 2 of the main move turns at 18 deg/s: less than half a turn of the input in 30
    ms, so 1e4 times."""
    head = 'name = "often"\nbasis = "assumed"\nsource = "made up"\n[shock]\npeak_m_s2 = 29.43\nduration_s = 0.03\n'
    (tmp_path / "often.toml").write_text(head + "start_s = 2.5\nevents = 20000\n")
    silent, often = load_case("shock"), load_case(str(tmp_path / "often.toml"))
    assert (silent.shock_events, often.shock_events) == (None, 20000.0)
    rows = [
        row_of(plan(BOOM, "transport", "phenotyping", vehicle=v).report, "inner", "gearbox momentary peaks")
        for v in (silent, often)
    ]
    assert [row.verdict for row in rows] == [Verdict.NOT_CHECKABLE, Verdict.FAIL]
    assert rows[1].limit == 1e4  # 3 rpm, 480 at the input: 0.24 turns


@pytest.mark.parametrize(
    ("shock", "resolved"),
    [({}, True), ({"shock_start": 4.9}, False), ({"shock_start": 9.0}, False), ({"shock_duration": 1e-3}, True)],
)
def test_a_shock_that_the_motion_does_not_hold_is_not_checkable(shock, resolved):
    report = plan(BOOM, "transport", "phenotyping", vehicle=replace(SHOCK, **shock)).report
    verdict = row_of(report, "inner", "gearbox momentary peak").verdict
    assert (verdict is not Verdict.NOT_CHECKABLE) == resolved


def test_a_shock_between_the_samples_of_a_file_is_not_checkable():
    coarse = replace(plan(BOOM, "transport", "phenotyping", step=0.1).trajectory, planned=None)
    report = check(BOOM, coarse, vehicle=SHOCK)
    assert row_of(report, "inner", "gearbox momentary peak").verdict is Verdict.NOT_CHECKABLE


def test_plan_knows_the_slope():
    """On a slope so steep that the drives decide, the least time is another than on level ground,
    and still keeps them."""
    heavy = BOOM.with_payload(20.0)
    level, steep = (plan(heavy, "transport", "phenotyping", profile="time-optimal", vehicle=v) for v in (LEVEL, SLOPE))
    assert abs(steep.report.duration - level.report.duration) > 1e-3
    row = row_of(steep.report, "lower", "motor torque")
    assert row.margin >= 0.5 - 1e-3


def test_vehicle_is_said_in_the_report():
    report = plan(BOOM, "transport", "phenotyping", vehicle=load_case("ditch")).report
    assert "vehicle case ditch" in report.notes[0]
    assert "assumed" in report.notes[0]
    assert {peak.joint: peak for peak in report.peaks}["inner"].vehicle > 100.0


def test_vehicle_at_rest_changes_nothing():
    rest = VehicleCase("rest", MADE_UP)
    moves = [plan(BOOM, "transport", "phenotyping", vehicle=v) for v in (LEVEL, rest)]
    np.testing.assert_allclose(moves[1].loads.tau, moves[0].loads.tau, rtol=0, atol=1e-12)
    again = check(BOOM, moves[0].trajectory, vehicle=rest)
    assert again.verdict is Verdict.INCOMPLETE
