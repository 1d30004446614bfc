"""The time-optimal law within the gearboxes' average torque."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from boom_model import Boom, inverse_dynamics
from planner import TimeOptimal, plan
from planner.paths.path import JointLine
from planner.timing.path_limits import InfeasiblePathError
from planner.timing.timing import Timing
from tests.builders import motion_along
from tests.limits import times, worst

BOOM = Boom.load().with_payload(15.0)
START, GOAL = BOOM.pose("transport"), BOOM.pose("phenotyping")


def limited(limit):
    """The boom with a catalogue whose gearbox allows another average torque [Nm]."""
    drives = (d and replace(d, gearbox=replace(d.gearbox, max_average_torque=limit)) for d in BOOM.drives)
    return replace(BOOM, drives=tuple(drives))


def averages(motion):
    """Cube means (5,) of |tau| weighted by |qd|, by Gauss's rule in every piece of the law; 0 of
    what rests."""
    breaks = np.asarray(motion.law.s.x)
    nodes, weights = np.polynomial.legendre.leggauss(4 if len(breaks) > 100 else 40)
    half, middle = np.diff(breaks)[:, None] / 2.0, (breaks[1:] + breaks[:-1])[:, None] / 2.0
    q, qd, qdd, _ = motion((middle + half * nodes).ravel())
    tau = inverse_dynamics(BOOM, q, qd, qdd, friction=True, reactions=False).tau
    share = (half * weights).reshape(-1, 1) * np.abs(qd)
    travel = share.sum(axis=0)
    return np.cbrt(np.divide((share * np.abs(tau) ** 3).sum(axis=0), travel, out=np.zeros(5), where=travel > 0.0))


def law(boom, **options):
    return motion_along(boom, JointLine(START, GOAL), Timing.of("time-optimal", **options))


@cache
def sharp():
    """The motion without a limit to the average."""
    return law(BOOM)


@pytest.fixture
def peak():
    return averages(sharp())[1:3]


@pytest.fixture
def slow():
    """The averages of a motion so slow that the load is merely held."""
    return averages(law(BOOM, duration=1000.0 * sharp().duration))[1:3]


def test_an_average_below_the_limit_changes_nothing(peak):
    assert law(limited(1.01 * peak.max()), average_torque=True).duration == sharp().duration
    assert law(limited(0.5 * peak.max())).duration == sharp().duration  # not asked for


@pytest.mark.parametrize("share", [0.9, 0.3])
def test_a_lower_limit_is_kept_and_no_slower_than_by_an_even_slowing(share, peak, slow):
    joint = int(np.argmax(peak - slow))
    limit = slow[joint] + share * (peak - slow)[joint]
    assert limit > slow.max()
    boom = limited(float(limit))
    motion = law(boom, average_torque=True)
    assert averages(motion)[1:3].max() <= limit * (1.0 + 1e-4)
    assert averages(motion)[1:3].max() >= limit * 0.97  # and not much slower than it must be
    found = worst(boom, motion, 5e-4)
    assert found.pop("outside") <= 1e-12
    assert max(found.values()) <= 1.001
    least, most = 1.0, 1000.0
    for _ in range(25):
        middle = np.sqrt(least * most)
        even = replace(sharp(), law=sharp().law.stretched(middle))
        least, most = (least, middle) if averages(even)[1:3].max() <= limit else (middle, most)
    assert sharp().duration < motion.duration <= sharp().duration * most * (1.0 + 1e-3)


@pytest.mark.parametrize("share", [0.7])
def test_the_jerk_bound_keeps_the_average_as_well(share, peak, slow):
    joint = int(np.argmax(peak - slow))
    limit = float(slow[joint] + share * (peak - slow)[joint])
    motion = law(limited(limit), average_torque=True, jerk_bound=True)
    assert averages(motion)[1:3].max() <= limit * (1.0 + 1e-4)
    t = times(motion, 1e-3)
    assert (np.abs(motion(t)[3]) / BOOM.limits.jerk).max() <= 1.001


def test_a_load_whose_holding_alone_averages_too_much_is_refused_with_joint_and_limit(slow):
    limit = 0.95 * float(slow.max())
    with pytest.raises(
        InfeasiblePathError, match=r"at (inner|lower) the load that is held alone averages \d+\.\d Nm"
    ) as caught:
        plan(limited(limit), START, GOAL, profile=TimeOptimal(average_torque=True))
    assert caught.value.joint == ("inner", "lower")[int(np.argmax(slow))]
    assert caught.value.demand == pytest.approx(slow.max(), rel=1e-3)
    assert caught.value.limit == limit
