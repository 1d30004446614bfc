"""Uncertainty of the tip by a calibration: linear theory against random booms, and its report."""

from dataclasses import replace

import numpy as np
import pytest

from boom_model import Basis, Boom, InputError, Origin, forward_kinematics, gravity_torque, tip_covariance, tip_deflection
from boom_model.arrays import read_only
from boom_model.calibration import INNER, UPPER, Calibration
from boom_model.drives.wind_up import wind_up
from planner import check, plan
from planner.checks.kinds import CheckKind

SHIPPED = Boom.load()
NAMES = ("L2", "L3", "L4", "L6", "L7", "L8", UPPER, INNER, "inner offset", "lower offset", "extension scale", "inner wind-up",
         "lower wind-up", "wrist offset")  # fmt: skip
SPREAD = np.array([3e-4, 2e-4, 4e-4, 3e-4, 3e-4, 2e-4, 1e-4, 1e-4, 2e-4, 2e-4, 2e-4, 0.1, 0.1, 1e-3])
Q = np.array([[0.3, 0.5, 1.6, 0.2, 0.4], [1.2, 1.1, 2.9, 0.9, -0.6], [0.0, 0.1, 1.3, 0.0, 1.0]])


def calibrated(boom: Boom = SHIPPED, spread=SPREAD, unequal: bool = True) -> Boom:
    """A boom whose calibration has correlated errors, and with a linkage of unequal links."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(len(NAMES), len(NAMES)))
    correlation = A @ A.T
    correlation /= np.sqrt(np.outer(np.diag(correlation), np.diag(correlation)))
    known = Calibration(
        origin=Origin(Basis.MEASURED, "boom calibrate measured.csv: 30 poses"),
        offset=read_only([0.01, 0.008, -0.007, 0.002, 0.01]),
        scale=read_only([1.0, 1.0, 1.0, 1.002, 1.0]),
        wind_up=read_only([1.0, 1.3, 0.8, 1.0, 1.0]),
        parameters=NAMES,
        covariance=read_only(correlation * np.outer(spread, spread)),
    )
    geometry = replace(boom.geometry, upper_less_lower=0.002, inner_less_outer=-0.003) if unequal else boom.geometry
    return replace(boom, geometry=geometry, calibration=known)


def tip_of(boom: Boom, by: np.ndarray, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """The tip (3,) of a boom whose figures are off by `by`, at readings of q (5,) with tau (5,)."""
    error, known, g = dict(zip(NAMES, by, strict=True)), boom.calibration, boom.geometry
    lengths = {name: getattr(g, name) + error[name] for name in ("L2", "L3", "L4", "L6", "L7", "L8")}
    lengths |= {"upper_less_lower": g.upper_less_lower + error[UPPER], "inner_less_outer": g.inner_less_outer + error[INNER]}
    joints = np.array(q)
    joints[[1, 2, 4]] += [error[f"{joint} offset"] for joint in ("inner", "lower", "wrist")]
    joints[3] += error["extension scale"] * (q[3] - known.offset[3]) / known.scale[3]
    for i, joint in ((1, "inner"), (2, "lower")):
        joints[i] -= error[f"{joint} wind-up"] * wind_up(boom.drives[i].gearbox, tau[i])
    return forward_kinematics(replace(boom, geometry=replace(g, **lengths)), joints).position


@pytest.mark.parametrize("unequal", [True, False])
def test_the_covariance_is_that_of_random_booms(unequal: bool):
    boom = calibrated(unequal=unequal)
    C = boom.calibration.covariance
    errors = np.random.default_rng(11).multivariate_normal(np.zeros(len(NAMES)), C, size=2000)
    for q, expected in zip(Q, tip_covariance(boom, Q), strict=True):
        tau = gravity_torque(boom, q)
        tips = np.array([tip_of(boom, by, q, tau) for by in errors])
        found = np.cov(tips.T)
        assert np.sqrt(np.trace(found)) == pytest.approx(np.sqrt(np.trace(expected)), rel=0.03)
        size = np.sqrt(np.diag(expected))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=0.06 * np.outer(size, size).max())


def test_the_budget_counts_the_measured_share_of_the_wind_up_and_two_deviations():
    boom = calibrated()
    tau = gravity_torque(boom, Q)
    bare = tip_deflection(replace(boom, calibration=None), Q, tau)
    budget = tip_deflection(boom, Q, tau)
    trace = np.sqrt(np.trace(tip_covariance(boom, Q), axis1=1, axis2=2))
    np.testing.assert_allclose(budget.geometry, trace, rtol=1e-12)
    np.testing.assert_allclose(
        budget.total - 2.0 * trace - np.linalg.norm(budget.wind_up, axis=-1),
        bare.total - np.linalg.norm(bare.wind_up, axis=-1),
        rtol=1e-9,
    )
    only_inner = replace(boom.calibration, wind_up=read_only([1.0, 2.0, 1.0, 1.0, 1.0]))
    twice = tip_deflection(replace(boom, calibration=only_inner), Q, tau * [0, 1, 0, 0, 0]).wind_up
    once = tip_deflection(replace(boom, calibration=None), Q, tau * [0, 1, 0, 0, 0]).wind_up
    np.testing.assert_allclose(twice, 2.0 * once, rtol=1e-12)


def test_plan_and_check_have_a_row_of_the_remaining_uncertainty():
    boom = calibrated(unequal=False)
    move = plan(boom, "transport", "phenotyping", duration=6.0)
    evaluation = move.evaluation
    (row,) = (row for row in move.report.rows if row.kind is CheckKind.TIP_GEOMETRY)
    covariance = tip_covariance(boom, evaluation.trajectory.q, evaluation.tau)
    assert row.demand == pytest.approx(np.sqrt(np.trace(covariance, axis1=1, axis2=2)).max(), rel=1e-12)
    assert (row.basis, row.unit) == (Basis.MEASURED, "m")
    assert "boom calibrate measured.csv: 30 poses" in row.source
    assert "lengths and zeros of the joints: boom calibrate measured.csv: 30 poses" in move.report.measured
    plain = check(replace(boom, calibration=None), move.trajectory)
    assert not any(row.kind is CheckKind.TIP_GEOMETRY for row in plain.rows)
    assert plain.measured == ()


def test_a_flat_linkage_is_left_out_and_said():
    boom = calibrated(unequal=False)
    flat = np.array([0.0, 0.0, np.pi, 0.2, 0.0])
    assert np.isnan(tip_covariance(boom, flat)).all()
    budget = tip_deflection(boom, np.stack([flat, Q[0]]), np.zeros((2, 5)))
    assert budget.geometry[0] == 0.0 < budget.geometry[1]
    assert "geometry, where the linkage is flat" in budget.uncounted


def test_no_calibration_no_covariance_and_a_wrong_name_is_refused():
    assert tip_covariance(SHIPPED, Q) is None
    known = calibrated().calibration
    with pytest.raises(InputError, match="unknown calibration parameter 'L17'"):
        replace(known, parameters=("L17", *NAMES[1:]))
