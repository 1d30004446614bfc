"""Measured figures: place in the boom's file, use in dynamics and checks, basis in reports."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from boom_model import Basis, Boom, InputError, Origin, Sourced, inverse_dynamics, mass_matrix
from boom_model.boom import Friction
from boom_model.boom_file import BOOM_FILE
from boom_model.drives.drive import motor_torque, reflected_inertia
from boom_model.measured import measured_figures, measured_lines
from planner import check
from tests.builders import main_move

LOG = Origin(Basis.MEASURED, "boom identify log.csv: to 0.1")
ROTOR = 'drive_inertia_kg{unit} = {{ value = {value}, basis = "measured", source = "boom identify log.csv: to 0.1" }}'


def with_rotors(tmp_path: Path, **values: float) -> Boom:
    """The shipped boom whose file has drive inertias."""
    text = BOOM_FILE.read_text(encoding="utf-8")
    for joint, value in values.items():
        line = ROTOR.format(unit="" if joint == "extension" else "_m2", value=value)
        text = text.replace(f"[joints.{joint}]\n", f"[joints.{joint}]\n{line}\n")
    file = tmp_path / "measured.toml"
    file.write_text(text, encoding="utf-8")
    return Boom.load(file)


def test_a_measured_drive_inertia_replaces_the_datasheets(tmp_path: Path):
    boom, shipped = with_rotors(tmp_path, inner=12.5, extension=9.0, wrist=0.2), Boom.load()
    np.testing.assert_allclose(boom.drive_inertia, [0.0, 12.5, 160**2 * 5.76e-4, 9.0, 0.2], rtol=1e-14)
    q = shipped.pose("phenotyping") - [0.0, 0.0, 0.3, 0.0, 0.0]
    added = mass_matrix(boom, q, drive_inertia=True) - mass_matrix(boom, q)
    np.testing.assert_allclose(added, np.diag(boom.drive_inertia), rtol=0, atol=1e-12)
    qdd = np.array([1.0, -2.0, 3.0, 0.5, 4.0])
    tau = inverse_dynamics(boom, q, 0.0 * qdd, qdd, drive_inertia=True).tau - inverse_dynamics(boom, q, 0.0 * qdd, qdd).tau
    np.testing.assert_allclose(tau, boom.drive_inertia * qdd, rtol=1e-9)
    lighter, printed = (motor_torque(each.drives[1], 50.0, 0.1, 1.0) for each in (boom, shipped))
    assert printed - lighter == pytest.approx((160**2 * 5.76e-4 - 12.5) / 160.0, rel=1e-9)


def test_another_drive_was_not_measured(tmp_path: Path):
    boom, shipped = with_rotors(tmp_path, inner=12.5, wrist=0.2), Boom.load()
    assert reflected_inertia(boom.drives[1]) == 12.5
    other = boom.with_drive("inner", shipped.drives[1]).with_drive("wrist", shipped.drives[1])
    np.testing.assert_allclose(other.drive_inertia[[1, 4]], 160**2 * 5.76e-4, rtol=1e-14)


def test_drive_inertia_goes_where_the_drive_is():
    measured = [Sourced(value, LOG) for value in (1.0, 2.0, 3.0, 4.0, 5.0)]
    boom = Boom.load().with_drive_inertia(measured)
    assert [rotor and rotor.value for rotor in boom.rotors] == [1.0, None, None, 4.0, 5.0]
    np.testing.assert_array_equal(boom.drive_inertia, [1.0, 2.0, 3.0, 4.0, 5.0])
    with pytest.raises(InputError, match="drive inertia of wrist is -1"):
        boom.with_drive_inertia([*measured[:4], Sourced(-1.0, LOG)])


def test_a_drive_inertia_that_is_none_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match=r"joints\.wrist\.drive_inertia_kg_m2"):
        with_rotors(tmp_path, wrist=-0.2)


def measured_boom() -> Boom:
    boom = Boom.load()
    bodies = {name: replace(body, origin=LOG) for name, body in boom.bodies.items()}
    friction = Friction(boom.friction.viscous, boom.friction.coulomb, (LOG,) * 5)
    return replace(boom, bodies=bodies, friction=friction)


def test_measured_figures_are_named_once_for_each_log():
    assert measured_figures(Boom.load()) == ()
    boom = measured_boom()
    assert measured_lines(boom) == ("masses, friction: boom identify log.csv",)
    some = replace(boom, friction=Friction(boom.friction.viscous, boom.friction.coulomb, (LOG, *(None,) * 4)))
    assert measured_lines(some) == ("masses, friction of yaw: boom identify log.csv",)


def test_torques_of_a_measured_boom_do_not_weaken_a_rows_basis():
    """A row is as good as its weakest figure.

    The friction that was assumed is measured, and the limit stays printed.
    """
    boom, move = Boom.load(), main_move("cubic", step=0.05).trajectory
    assumed = replace(boom, friction=replace(boom.friction, origins=(replace(LOG, basis=Basis.ASSUMED),) * 5))
    bases = {}
    for name, each in (("assumed", assumed), ("measured", measured_boom())):
        report = check(each, move)
        bases[name] = {row.check: row.basis for row in report.rows if row.joint == "inner"}
        assert bool(report.measured) == (name == "measured")
    assert bases["assumed"]["gearbox average"] is Basis.ASSUMED
    assert bases["measured"]["gearbox average"] is Basis.PRINTED
    assert measured_boom().bodies["inner"].origin is LOG
