"""Why a move cannot be made, and what would make it possible: each suggestion applied by hand, and
a smaller one."""

import re
from dataclasses import replace

import numpy as np
import pytest

from boom_model import JOINTS, Boom, InfeasibleError, forward_kinematics, inverse_dynamics
from planner import MoveSpec, Verdict, plan
from planner.suggestions import suggestions
from planner.timing.profile import SHORTEST
from tests.builders import POST, ROUND_POST, with_shapes
from tests.limits import EFFICIENCY, INERTIA, motor_allows

BOOM = Boom.load()
POSES = "transport", "phenotyping"
STEP = 0.05


def works(boom, start=POSES[0], goal=POSES[1], **options):
    try:
        return plan(boom, start, goal, **options).report.verdict is not Verdict.FAIL
    except InfeasibleError:
        return False


def by_kind(found):
    return {kind: [each.sentence for each in found if each.change == kind] for kind in {each.change for each in found}}


def factor(sentence):
    return float(re.search(r"([\d.]+) times", sentence)[1])


@pytest.mark.parametrize("profile", ["cubic", "time-optimal"])
def test_payload_ratio_and_drive_that_mend_an_overload(profile):
    heavy = BOOM.with_payload(38.0)
    assert not works(heavy, profile=profile, step=STEP)
    found = by_kind(suggestions(heavy, MoveSpec.of(*POSES, profile=profile)))
    assert {"payload", "ratio", "drive"} & set(found)
    (sentence,) = found["payload"]
    mass = float(re.fullmatch(r"a payload of ([\d.]+) kg instead of 38 kg", sentence)[1])
    assert works(heavy.with_payload(mass), profile=profile)
    assert not works(heavy.with_payload(mass + 0.2), profile=profile)
    for kind in {"ratio", "drive"} & set(found):
        for sentence in found[kind]:
            joints = [JOINTS.index(name) for name in JOINTS if re.search(rf"\b{name}\b", sentence)]

            def changed(times, kind=kind, joints=joints):
                drives = list(heavy.drives)
                for i in joints:
                    motor, gear = drives[i].motor, drives[i].gearbox
                    if kind == "ratio":
                        drives[i] = replace(drives[i], gearbox=replace(gear, ratio=gear.ratio * times))
                    else:
                        motor_names = ("running_torque", "holding_torque")
                        gear_names = ("start_stop_torque", "max_average_torque", "peak_torque", "continuous_torque")
                        motor = replace(motor, **{name: getattr(motor, name) * times for name in motor_names})
                        gear = replace(gear, **{name: getattr(gear, name) * times for name in gear_names})
                        drives[i] = replace(drives[i], motor=motor, gearbox=gear)
                return replace(heavy, drives=tuple(drives))

            assert works(changed(factor(sentence)), profile=profile), sentence
            assert not works(changed(factor(sentence) * 0.97), profile=profile), sentence


@pytest.mark.parametrize("profile", SHORTEST)
def test_duration_that_mends_haste(profile):
    least = plan(BOOM, *POSES, profile=profile).report.duration
    found = by_kind(suggestions(BOOM, MoveSpec.of(*POSES, profile=profile, duration=0.8 * least)))
    (sentence,) = found["duration"]
    duration = float(re.match(r"a duration of ([\d.]+) s instead of", sentence)[1])
    assert least - 1e-9 <= duration <= least + 0.0101
    assert works(BOOM, profile=profile, duration=duration)
    assert not works(BOOM, profile=profile, duration=0.98 * duration)


def test_limits_that_mend_haste_are_those_of_the_joints_that_hold_the_move_back():
    """The cubic's least duration falls in proportion to the speed of the joint that decides, until
    the next one does."""
    least = plan(BOOM, *POSES).report.duration
    asked = least / 1.3
    found = by_kind(suggestions(BOOM, MoveSpec.of(*POSES, duration=asked)))
    for sentence in found["limit"]:
        joints = np.isin(JOINTS, [name for name in JOINTS if re.search(rf"\b{name}\b", sentence)])

        def faster(times, joints=joints):
            scale = np.where(joints, times, 1.0)
            rates = {name: getattr(BOOM.limits, name) * scale for name in ("velocity", "acceleration", "jerk")}
            return replace(BOOM, limits=replace(BOOM.limits, **rates))

        assert works(faster(factor(sentence)), duration=asked)
        assert not works(faster(factor(sentence) * 0.98), duration=asked)


def test_an_order_that_mends_an_overload_really_does():
    """Raising the arm while it runs out asks for more than either end does; raised first, it runs
    out upright."""
    start, goal = np.array([0.2, 1.4, np.pi, 0.0, 0.0]), np.array([0.2, 1.4, 1.5, 1.0, 0.0])
    raised, run_out = goal.copy(), start.copy()
    raised[3], run_out[3] = start[3], goal[3]
    boom = BOOM.with_payload(30.0)
    found = by_kind(suggestions(boom, MoveSpec.of(start, goal, profile="time-optimal")))
    assert found["order"] == ["move the extension last, separately"]
    assert not works(boom, start, goal, profile="time-optimal")
    assert works(boom, start, goal, profile="time-optimal", via=[raised])
    assert not works(boom, start, goal, profile="time-optimal", via=[run_out])


def test_what_works_needs_no_suggestion():
    assert suggestions(BOOM, MoveSpec.of(*POSES)) == ()


def test_a_shape_in_the_way_is_not_mended_by_a_stronger_drive():
    inside = ROUND_POST[0].copy()
    inside[0] = np.radians(45)
    assert suggestions(with_shapes(POST), MoveSpec.of(ROUND_POST[0], inside)) == ()


@pytest.mark.parametrize("profile", SHORTEST)
def test_too_short_a_duration_names_joint_limit_place_and_ratio(profile):
    boom = BOOM.with_payload(20.0)
    with pytest.raises(InfeasibleError) as caught:
        plan(boom, *POSES, profile=profile, duration=2.0)
    said = re.search(
        r"in 2 s (\w+) would reach ([\d.]+) times its ([\w ]+) limit at ([\d.]+) s(?: \((.*)\))?", str(caught.value)
    )
    joint, ratio, limit, at, parts = said.groups()
    i = JOINTS.index(joint)
    (motion,) = plan(boom, *POSES, profile=profile).motions
    hasty = replace(motion, law=motion.law.stretched(2.0 / motion.duration))
    # The printed time has two digits: the ratio is looked for around it, either side of a jump.
    t = np.clip(float(at) + np.linspace(-0.006, 0.006, 2001), 0.0, 2.0)
    q, qd, qdd, qddd = hasty(t)
    tau = inverse_dynamics(boom, q, qd, qdd, reactions=False).tau[:, i]
    demand = {
        "velocity": np.abs(qd[:, i]) / boom.limits.velocity[i],
        "acceleration": np.abs(qdd[:, i]) / boom.limits.acceleration[i],
        "jerk": np.abs(qddd[:, i]) / boom.limits.jerk[i],
        "gearbox torque": np.abs(tau) / 460.0,
        "motor torque": np.abs(tau + EFFICIENCY * INERTIA * qdd[:, i]) / motor_allows(qd[:, i]),
    }[limit]
    assert float(ratio) == pytest.approx(demand.max(), rel=0.01)
    assert (parts is not None) == limit.endswith("torque")


def test_an_overload_names_its_shares_and_they_add_up():
    with pytest.raises(InfeasibleError) as caught:
        plan(BOOM.with_payload(40.0), *POSES, profile="time-optimal")
    text = str(caught.value)
    tip = ", ".join(f"{x:.3f}" for x in forward_kinematics(BOOM, BOOM.pose("phenotyping")).position)
    assert f"at 100.0% of the path (tip {tip} m)" in text
    total = float(re.search(r"joint lower needs ([\d.]+) Nm only to hold its load there", text)[1])
    inside = re.search(r"there \((.*?)\), and its drive allows", text)[1]
    shares = dict(re.findall(r"([a-z, ]+?) (-?[\d.]+) Nm", inside))
    shares = {name.strip(", "): float(value) for name, value in shares.items()}
    assert set(shares) == {"gravity", "payload"}
    assert sum(shares.values()) == pytest.approx(total, abs=0.11)
    goal, still = BOOM.pose("phenotyping"), np.zeros(5)
    empty = inverse_dynamics(BOOM.with_payload(0.0), goal, still, still).tau[2]
    assert shares["gravity"] == pytest.approx(empty, abs=0.06)
