"""The time-optimal profile against an independent optimum: direct collocation on Pinocchio's
dynamics (`minimum_time.py`)."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from boom_model import Boom
from boom_model.arrays import Array
from boom_model.boom import Friction
from planner import Move, TipTarget, plan
from planner.paths.path import JointLine
from tests.minimum_time import DRIVEN, INTERVALS, minimum_time, throughout, worst_ratios

BOOM = Boom.load()
SLOWER = 0.01
FASTER = 2e-4
"""The collocation's own error, of which 8e-5 was seen: at the ends of its steps at most."""
WORST_RATIO = 1.001
SHIPPED, RAISED, FAR_RAISED, OUT_OF_THE_WAY = (1.0, 1.0), (3.0, 10.0), (8.0, 40.0), (20.0, 100.0)
"""Factors of the joints' velocity and acceleration. With those shipped, the drives seldom decide.
"""


class Case(NamedTuple):
    start: Array
    goal: Array
    payload: float
    """[kg]"""
    factors: tuple[float, float]

    @property
    def boom(self) -> Boom:
        limits, (faster, harder) = BOOM.limits, self.factors
        raised = replace(limits, velocity=faster * limits.velocity, acceleration=harder * limits.acceleration)
        return replace(BOOM.with_payload(self.payload), limits=raised)

    @property
    def line(self) -> JointLine:
        return JointLine(self.start, self.goal)

    @property
    def duration_without_drives(self) -> float:
        """A trapezoid or a triangle of s', the optimum where velocity and
        acceleration alone count."""
        span = np.abs(self.goal - self.start)
        v, a = (np.min(limit / span) for limit in (self.boom.limits.velocity, self.boom.limits.acceleration))
        return 1.0 / v + v / a if v * v < a else 2.0 / np.sqrt(a)


def random_cases(count: int) -> list[Case]:
    """Payloads spread over 0 to 10 kg, the joints' limits raised to each degree in turn."""
    rng, limits, pairs = np.random.default_rng(20), BOOM.limits, []
    while len(pairs) < count:
        pair = rng.uniform(limits.lower, limits.upper, (2, 5))
        if limits.contain(pair).all():
            pairs.append(pair)
    factors = (SHIPPED, FAR_RAISED, RAISED, OUT_OF_THE_WAY)
    payloads = np.linspace(0.0, 10.0, count)
    return [Case(*pair, payload, factors[i % 4]) for i, (pair, payload) in enumerate(zip(pairs, payloads, strict=True))]


OUT, BACK = (BOOM.pose("transport"), BOOM.pose("phenotyping")), (BOOM.pose("phenotyping"), BOOM.pose("transport"))
HEAVY = [Case(*OUT, 20.0, SHIPPED), Case(*OUT, 24.0, SHIPPED), Case(*OUT, 24.0, RAISED), Case(*BACK, 24.0, OUT_OF_THE_WAY)]
CASES = random_cases(20) + HEAVY
TORQUE_LIMITED = [1, 3, 5, 7, 11, 13, 15, 19, 20, 21, 22, 23]
"""8 of the 20 random moves, which the drives make longer by over 1 %, and all the heavy ones."""


def planned(boom: Boom, case: Case) -> Move:
    return plan(boom, case.start, case.goal, profile="time-optimal")


@cache
def optimum(number: int) -> float:
    return minimum_time(CASES[number].boom, CASES[number].line).duration


@cache
def planned_with_ratios(number: int) -> tuple[Move, dict[str, float]]:
    boom = CASES[number].boom
    move = planned(boom, CASES[number])
    return move, worst_ratios(boom, *throughout(move.motions[0]))


def assert_kept(ratios: dict[str, float]) -> None:
    for limit, ratio in ratios.items():
        assert ratio <= WORST_RATIO, limit


def lost(move: Move, optimum: float) -> float:
    return move.report.duration / optimum - 1.0


@pytest.mark.parametrize("number", range(len(CASES)))
def test_duration_is_the_optimum(number):
    """0.51 % lost at most, by limits held at both ends of each of the planner's steps; 0.01 % where
    drives do not decide."""
    move, ratios = planned_with_ratios(number)
    assert -FASTER < lost(move, optimum(number)) < SLOWER
    assert_kept(ratios)


def test_eight_of_the_twenty_and_all_heavy_moves_are_torque_limited():
    """A planner that knew no torques would miss these optima by more than the 1 % allowed."""
    longer = [optimum(i) / case.duration_without_drives for i, case in enumerate(CASES)]
    assert [i for i, ratio in enumerate(longer) if ratio > 1.0 + SLOWER] == TORQUE_LIMITED


@pytest.mark.parametrize("number", TORQUE_LIMITED)
def test_torque_limited_moves_meet_the_falling_curve(number):
    assert planned_with_ratios(number)[1]["motor on its curve"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("case", CASES[::4], ids=str)
def test_collocation_finds_the_trapezoid(case):
    found = minimum_time(case.boom, case.line, drives=False).duration
    assert found == pytest.approx(case.duration_without_drives, rel=FASTER)


@pytest.mark.parametrize("number", [3, 11, 15])
def test_collocation_has_converged(number):
    finer = minimum_time(CASES[number].boom, CASES[number].line, intervals=2 * INTERVALS).duration
    assert optimum(number) == pytest.approx(finer, rel=FASTER)


@pytest.mark.parametrize(("payload", "factors"), [(10.0, SHIPPED), (24.0, RAISED), (6.0, OUT_OF_THE_WAY)])
def test_tip_line_is_the_optimum(payload, factors):
    """A path with curvature in the joints."""
    boom = Case(*OUT, payload, factors).boom
    move = plan(boom, TipTarget((1.4, 0.0, 1.0)), TipTarget((2.0, 0.5, 0.6)), profile="time-optimal", along="line")
    assert -FASTER < lost(move, minimum_time(boom, move.motions[0].path).duration) < SLOWER
    assert_kept(worst_ratios(boom, *throughout(move.motions[0])))


@pytest.mark.parametrize("number", [3, 5, 20, 22])
def test_duration_with_friction_is_the_optimum_that_gives_it_no_credit_while_braking(number):
    """0.72 % lost at most, with the joints' limits out of the way."""
    case, some = CASES[number], np.zeros(5)
    some[DRIVEN] = 10.0
    boom = replace(case.boom, friction=Friction(viscous=some, coulomb=some, origins=(None,) * 5))
    move = planned(boom, case)
    assert -FASTER < lost(move, minimum_time(boom, case.line, credit=False).duration) < SLOWER
    assert_kept(worst_ratios(boom, *throughout(move.motions[0])))
