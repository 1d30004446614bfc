"""Energy of motions and missions: the balance of work, the losses, the supply."""

import json
from dataclasses import replace

import numpy as np
import pytest

from boom_model import JOINTS, Boom, Sourced
from planner import plan
from planner.checks.drives.duty import Duty
from planner.checks.energy import Current, Supply, Surplus, energy_of, joint_powers
from planner.checks.evaluation import at_samples
from planner.missions.mission import check_cycle, cycle_energy, load_mission, plan_cycle
from planner.motion.vehicle import LEVEL, load_case
from planner.reports.report import Report
from tests.builders import ORIGIN, main_move, planned_mission, with_drives, without_drives

BOOM = Boom.load()
RUBBING = replace(
    BOOM, friction=replace(BOOM.friction, viscous=np.array([8.0, 20.0, 15.0, 40.0, 1.0]), coulomb=np.full(5, 3.0))
)
HELD = 36.1
"""2 I^2 R of the fitted motors [W]."""
HOLDING_MISSION = """
name = "holding"
basis = "assumed"
source = "a test"
start = "phenotyping"

[[steps]]
hold_s = 100

[[steps]]
pause_s = 1000
"""


def cut(motion, share):
    """The beginning of a motion: it ends while the arm moves."""
    n = int(share * len(motion.t))
    return replace(motion, planned=None, qddd=None, **{name: getattr(motion, name)[:n] for name in ("t", "q", "qd", "qdd")})


@pytest.mark.parametrize("profile", ["cubic", "trapezoidal", "time-optimal"])
@pytest.mark.parametrize("share", [0.3, 0.61, 1.0])
@pytest.mark.parametrize("vehicle", [LEVEL, load_case("slope")], ids=["level", "slope"])
def test_work_is_energy_gained_and_lost(profile, share, vehicle):
    motion = cut(main_move(profile, step=0.002).trajectory, share)
    balance = energy_of(at_samples(RUBBING, motion, vehicle=vehicle, reactions=False)).balance
    assert abs(balance.residual) <= 1e-3 * balance.turnover
    assert balance.friction > 1.0
    assert abs(balance.potential) > 1.0
    if share < 1.0:
        assert balance.kinetic > 0.5


def test_the_balance_of_a_mission_counts_every_leg():
    cycle = planned_mission("field-day")
    energy = cycle_energy(cycle, at_samples(BOOM, cycle.trajectory, reactions=False))
    assert abs(energy.balance.residual) <= 1e-5 * energy.balance.turnover
    assert energy.balance.potential == pytest.approx(0.0, abs=1e-6)  # it ends where it starts
    assert energy.balance.turnover > 500.0
    driving, braking = (sum(getattr(each, name) for each in energy.joints) for name in ("driving", "braking"))
    assert driving - braking == pytest.approx(energy.balance.work, abs=1e-3)


def test_the_motor_gives_what_joint_rotor_gearbox_and_winding_take():
    motion = cut(main_move("quintic", step=0.002).trajectory, 0.7)
    evaluation = at_samples(BOOM, motion, reactions=False)
    duty = Duty.alone(motion.t)
    inertia = 160**2 * (4.0e-4 + 176e-6)
    for i in (1, 2):
        power = joint_powers(evaluation, Supply(efficiency=1.0))[i]
        rotor = 0.5 * inertia * (motion.qd[-1, i] ** 2 - motion.qd[0, i] ** 2)
        assert duty.weight @ power.rotor == pytest.approx(rotor, rel=1e-3)
        total = power.output + power.rotor + power.gear_loss + power.copper
        np.testing.assert_allclose(power.electrical, total, atol=1e-9)
        np.testing.assert_allclose(power.copper, HELD)
        assert (power.gear_loss >= -1e-12).all()


@pytest.fixture
def holding(tmp_path):
    file = tmp_path / "holding.toml"
    file.write_text(HOLDING_MISSION)
    return plan_cycle(BOOM, load_mission(str(file)))


@pytest.mark.parametrize(
    ("current", "seconds"),  # that at full current take as much
    [(Current.FULL, 1100.0), (Current.REDUCED, 1100.0 / 4.0), (Current.BRAKE, 100.0 / 4.0)],
)
def test_holding_takes_the_winding_s_loss(holding, current, seconds):
    energy = cycle_energy(holding, at_samples(BOOM, holding.trajectory), Supply(current, efficiency=0.8))
    for joint in energy.joints[1:3]:
        assert joint.copper == pytest.approx(HELD * seconds, rel=1e-12)
        assert joint.electrical == pytest.approx(HELD * seconds / 0.8, rel=1e-12)
    assert energy.drawn == pytest.approx(2.0 * HELD * seconds / 0.8, rel=1e-12)
    assert energy.peak_A == pytest.approx(energy.peak_W / 80.0)


def test_without_a_brake_the_motor_holds_through_the_pause(holding):
    loose = with_drives(BOOM, brake=Sourced(False, ORIGIN))
    energy = cycle_energy(holding, at_samples(loose, holding.trajectory))
    assert energy.joints[1].copper == pytest.approx(HELD * 1100.0 / 4.0)


def test_a_current_that_follows_the_load(holding):
    evaluation = at_samples(BOOM, holding.trajectory)
    energy = cycle_energy(holding, evaluation, Supply(Current.LOAD))
    for i in (1, 2):
        torque = evaluation.static[0, i] / 160.0
        assert energy.joints[i].copper == pytest.approx(100.0 * HELD * (torque / 7.2) ** 2, rel=1e-9)


def test_what_is_given_back_goes_to_the_battery_or_the_resistor():
    # Down onto the plot: the load drives both joints. With the least current most comes back.
    evaluation = at_samples(BOOM, plan(BOOM, "phenotyping", "transport").trajectory)
    supplies = [Supply(Current.LOAD, surplus=sink) for sink in (Surplus.RESISTOR, Surplus.BATTERY)]
    lost, kept = (energy_of(evaluation, supply=supply) for supply in supplies)
    assert lost.returned == kept.returned > 20.0
    assert lost.drawn - kept.drawn == pytest.approx(lost.returned)
    known = [power.electrical for power in joint_powers(evaluation, Supply(Current.LOAD))[1:3]]
    assert lost.peak_returned_W == pytest.approx(-np.sum(known, axis=0).min())
    assert lost.peak_W == pytest.approx(np.sum(known, axis=0).max())


def test_what_is_not_known_is_said():
    energy = energy_of(at_samples(without_drives(BOOM), main_move().trajectory))
    assert (energy.drawn, energy.peak_W, energy.peak_A, energy.unknown) == (None, None, None, JOINTS)
    assert energy.sentence.startswith("supply: not known")
    assert energy_of(main_move().evaluation).unknown == ("yaw", "extension", "wrist")
    for case in ({"vehicle": load_case("track")}, {"payload_as": "force"}):
        assert energy_of(at_samples(BOOM, main_move().trajectory, **case)).balance is None


def test_reports_hold_the_energy():
    for report in (main_move().report, check_cycle(BOOM, planned_mission("field-day"))):
        assert isinstance(report, Report)
        found = json.loads(json.dumps(report.to_json({}), allow_nan=False))["energy"]
        assert found["drawn_J"] == report.energy.drawn > 0.0
        assert "## Power and energy" in report.to_markdown()
        rows = {(row.joint, row.check): row for row in report.rows}
        assert rows["inner", "motor holding power"].demand == pytest.approx(HELD)
        assert rows["lower", "motor peak power"].demand > 50.0
