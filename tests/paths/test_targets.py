"""Targets as people write them, and what becomes of them."""

import numpy as np
import pytest

from boom_model import ActuatorAngle, ActuatorHorizontal, Boom, FixedExtension, InfeasibleError, InputError, forward_kinematics
from boom_model.kinematics.constraints import parse_constraint
from planner.paths.targets import TipTarget, parse_pitch, parse_target, resolve, unreachable

BOOM = Boom.load()
DOWN = -np.pi / 2.0


def test_targets_are_read_in_degrees_and_metres():
    assert parse_target("transport") == "transport"
    np.testing.assert_allclose(parse_target("q=0,90,180,0.25,-45"), [0, np.pi / 2, np.pi, 0.25, -np.pi / 4], atol=1e-15)
    assert parse_target("tip=1.4,-0.5,1.0") == TipTarget((1.4, -0.5, 1.0))


def test_pitches_and_holds():
    assert [parse_pitch(p) for p in ("down", "level", "up")] == [-np.pi / 2, 0.0, np.pi / 2]
    assert parse_pitch("-30") == pytest.approx(-np.pi / 6, abs=1e-15)
    assert parse_constraint("horizontal") == ActuatorHorizontal()
    assert parse_constraint("actuator=-30") == ActuatorAngle(np.radians(-30.0))
    assert parse_constraint("extension=0.25") == FixedExtension(0.25)


@pytest.mark.parametrize(
    "text", ["q=1,2,3", "q=1,2,3,4,5,6", "tip=1,2", "tip=1,2,x", "q=1,2,nan,4,5", "tip=1,inf,2", "tup=1,2,3"]
)
def test_malformed_targets_are_refused(text):
    with pytest.raises(InputError, match=text.partition("=")[0]):
        parse_target(text)


@pytest.mark.parametrize("text", ["sideways", "extension", "extension=", "extension=nan", "actuator=x", "horizontal=1"])
def test_malformed_holds_are_refused(text):
    with pytest.raises(InputError, match="constraint"):
        parse_constraint(text)


@pytest.mark.parametrize("text", ["", "nan", "left"])
def test_malformed_pitches_are_refused(text):
    with pytest.raises(InputError, match="pitch"):
        parse_pitch(text)


def test_tip_target_resolves_to_a_joint_position_that_reaches_it():
    q = resolve(BOOM, TipTarget((1.4, 0.0, 1.0)), DOWN, FixedExtension(0.25))
    tip = forward_kinematics(BOOM, q)
    np.testing.assert_allclose(tip.position, [1.4, 0.0, 1.0], atol=1e-14)
    assert tip.pitch == pytest.approx(DOWN, abs=1e-14)
    assert BOOM.limits.contain(q)


def test_unknown_pose_lists_those_there_are():
    with pytest.raises(InputError, match="unknown pose 'parking'; there are: phenotyping, transport"):
        resolve(BOOM, "parking", DOWN, ActuatorHorizontal())


@pytest.mark.parametrize(
    ("degrees", "message"),
    [
        ([0, 130, 180, 0, 0], "inner 130 deg is 10 deg above its limit of 120 deg"),
        ([0, 50, 52, 0, 0], "lower - inner = 2 deg is 3 deg below the linkage's coupled limit of 5 deg"),
        ([0, 50, 90, 1.5, 0], "extension 1.5 m is 0.5 m above its limit of 1 m"),
    ],
)
def test_joint_position_outside_a_limit_names_it(degrees, message):
    q = np.radians(degrees)
    q[3] = degrees[3]
    with pytest.raises(InfeasibleError, match=message):
        resolve(BOOM, q, DOWN, ActuatorHorizontal())


def test_target_out_of_reach_says_how_far_and_the_nearest_point():
    message = unreachable(BOOM, (2.0, 0.0, 3.0), DOWN, FixedExtension(0.0))
    distance = float(message.split(" m away")[0].rsplit(" ", 1)[1])
    nearest = np.array([float(x) for x in message.split("is (")[1].split(")")[0].split(",")])
    assert "out of reach" in message
    assert distance == pytest.approx(np.linalg.norm(nearest - [2.0, 0.0, 3.0]), abs=1e-3)
    resolve(BOOM, TipTarget(tuple(nearest * (1 - 1e-5))), DOWN, FixedExtension(0.0))


def test_target_outside_the_limits_says_which():
    with pytest.raises(InfeasibleError, match=r"only outside the limits .*wrist 180 deg is 90 deg above its limit"):
        resolve(BOOM, TipTarget((0.0, 2.5, 0.8)), np.pi / 2.0, ActuatorHorizontal())
