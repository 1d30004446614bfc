"""Study files, designs and samples: against files that are edited by hand, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import tomlkit
from scipy.stats import kstest, norm

from boom_model import Boom, Catalogue, InputError, gravity_torque
from boom_model.boom_file import BOOM_FILE
from boom_model.link_design.link import LINKS_FILE
from boom_model.toml_file import parse_toml
from planner.checks.energy import joint_powers
from planner.checks.evaluation import at_samples
from planner.checks.rows import SAMPLING_SLACK
from planner.files import named_file
from planner.links.design import design_link
from planner.links.task import LinkTask
from planner.missions.mission import check_cycle, load_mission, mission_file, plan_cycle
from planner.reports.answer import usage
from planner.studies.analysis import Results
from planner.studies.designed_link import link_task, with_designed_link
from planner.studies.designs import DesignKind, design
from planner.studies.engine import run
from planner.studies.factors import Factor
from planner.studies.sample import compute, make
from planner.studies.store import Store
from planner.studies.study import NAMED_STUDIES, load_study, named_studies
from planner.timing.profile import SHORTEST
from tests.builders import planned_mission
from tests.studies.helpers import SMALL, normal, uniform


@pytest.fixture
def loaded(tmp_path):
    """Loads the small study with other lines, and further text at its end."""

    def load(*changes, more="", **options):
        text = SMALL.format(samples=8) + more
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "s.toml").write_text(text)
        return load_study(str(tmp_path / "s.toml"), **options)

    return load


def factor(name, keys, rest):
    return f'[[factors]]\nname = "{name}"\nkeys = {keys}\nsource = "this test"\n{rest}\n'


# Files


def test_every_shipped_study_can_be_loaded_and_its_first_point_makes_a_boom():
    assert named_studies() == ("lighter-boom", "lighter-motor", "payload-reach", "tolerance")
    for name in named_studies():
        study = load_study(name)
        boom, _, _ = make(study.case, study.design.values(0))
        assert boom.name == Boom.load().name
        assert all(factor.source for factor in study.design.factors)


MISTAKES = {
    "an unknown key": ([('payload"\nd', 'pay_load"\nd')], "unknown key of factor payload 'pay_load'; did you mean payload"),
    "an unknown key of the boom": (
        [("bodies.inner.mass_kg", "bodies.innner.mass_kg")],
        "unknown key 'bodies.innner.mass_kg'; did you mean bodies.inner.mass_kg",
    ),
    "an unknown key of the file": ([("seed = 3", "sead = 3")], "key sead is not known"),
    "no width": ([("high = 1.1", "high = 0.9")], "low is 0.9 and high is 0.9; low must be below high"),
    "a negative deviation": ([("std = 1.0", "std = -1.0")], "std is -1; it must be above 0"),
    "an infinite mean": ([("mean = 10.0", "mean = inf")], "factors.0.mean: input should be a finite number"),
    "figures of another law": ([("std = 1.0", "high = 1.0")], "normal takes distribution, mean, std"),
    "an unknown distribution": ([('"normal"', '"gauss"')], "factors.0.distribution"),
    "a relative word": ([("bodies.inner.mass_kg", "joints.inner.drive.motor")], "which a relative value cannot multiply"),
    "an unknown design": ([("monte-carlo", "monte-karlo")], "key design"),
    "two of one name": ([('name = "link mass"', 'name = "payload"')], "two factors are named payload"),
    "an unknown joint": ([('["inner"]', '["iner"]')], "unknown joint 'iner'; did you mean inner"),
    "an unknown mission": ([("table-3-1", "table-3-2")], "unknown mission 'table-3-2'; did you mean table-3-1"),
    "a grid of a distribution": ([("monte-carlo", "grid")], "factor payload: a grid needs values"),
    "sobol with 8 + 1": ([("monte-carlo", "sobol"), ("samples = 8", "samples = 9")], "needs a power of two, such as 8"),
    "too many samples": ([("samples = 8", "samples = 100000000")], "at most 10,000,000"),
    "a boundary without a grid": ([("seed = 3", 'seed = 3\nboundary = "payload"')], "it must be a factor of a grid"),
    "a placeholder that is nowhere": ([('key = "payload"\n', "")], "{payload} stands nowhere"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_named(loaded, name):
    changes, said = MISTAKES[name]
    with pytest.raises(InputError) as error:
        loaded(*changes)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


# Designs and distributions


@pytest.mark.parametrize("kind", [DesignKind.MONTE_CARLO, DesignKind.LATIN_HYPERCUBE, DesignKind.SOBOL])
def test_points_are_drawn_from_the_distributions(kind):
    triangular = Factor("c", (), False, shape="triangular", low=0.0, mode=1.0, high=4.0)
    factors = (normal("a", 3.0, 0.5), uniform("b", -1.0, 2.0), triangular)
    points = design(kind, factors, 1024, seed=5)
    drawn = points.coordinates[points.first :]
    for column, law in zip(
        drawn.T, (("norm", (3.0, 0.5)), ("uniform", (-1.0, 3.0)), ("triang", (0.25, 0.0, 4.0))), strict=True
    ):
        assert kstest(column, *law).pvalue > 0.01
    again = design(kind, factors, 1024, seed=5)
    np.testing.assert_array_equal(points.coordinates, again.coordinates)
    assert (design(kind, factors, 1024, seed=6).coordinates[points.first :] != drawn).any()


def test_nominal_and_one_at_a_time_points_come_first():
    words = Factor("w", (), False, levels=("x", "y", "z"))
    points = design(DesignKind.MONTE_CARLO, (normal("a", 3.0, 0.5), words), 4, seed=1)
    assert points.points == ("nominal", "a", "a", "w", "w")
    assert [points.values(i) for i in range(5)] == [(3.0, "x"), (2.5, "x"), (3.5, "x"), (3.0, "y"), (3.0, "z")]
    assert len(points) == 9
    assert {points.point(i) for i in range(5, 9)} == {"design"}


def test_a_grid_has_every_combination_once():
    factors = (Factor("a", (), False, levels=(1.0, 2.0)), Factor("b", (), False, levels=("x", "y", "z")))
    points = design(DesignKind.GRID, factors, 1, seed=1)
    assert {points.values(i) for i in range(len(points))} == {(a, b) for a in (1.0, 2.0) for b in "xyz"}
    assert len(points) == 6


# Samples


def test_a_sample_is_what_edited_files_give(loaded, tmp_path):
    """Every kind of key, against the same changes made to the files and loaded from them."""
    more = "".join(
        [
            factor("torque", '["catalogue.motors.MST342C02.running_torque_Nm"]', "relative = true\nvalues = [0.9]"),
            factor("inertia", '["boom.bodies.outer.inertia_kg_m2"]', "relative = true\nvalues = [1.5]"),
            factor("motor", '["boom.joints.lower.drive.motor"]', 'values = ["MST341B02"]'),
            factor("length", '["boom.geometry.L4_m"]', "values = [0.98]"),
            factor("time", '["mission.steps.0.duration_s"]', "values = [6.0]"),
        ]
    )
    study = loaded(more=more)
    values = (8.0, 1.05, 0.9, 1.5, "MST341B02", 0.98, 6.0)
    found = compute(study.case, values)

    boom_text, mission = (tomlkit.parse(p.read_text()) for p in (BOOM_FILE, mission_file("table-3-1")))
    boom_text["bodies"]["inner"]["mass_kg"] = 10.90205 * 1.05
    boom_text["bodies"]["outer"]["inertia_kg_m2"] = [1.5 * float(x) for x in boom_text["bodies"]["outer"]["inertia_kg_m2"]]
    boom_text["joints"]["lower"]["drive"]["motor"] = "MST341B02"
    boom_text["geometry"]["L4_m"] = 0.98
    mission["steps"][0]["duration_s"] = 6.0
    (tmp_path / "boom.toml").write_text(tomlkit.dumps(boom_text))
    (tmp_path / "mission.toml").write_text(tomlkit.dumps(mission))
    sheet = Catalogue.load().motors["MST342C02"]
    weaker = replace(sheet, running_torque=0.9 * sheet.running_torque)
    boom = Boom.load(tmp_path / "boom.toml").with_payload(8.0)
    boom = boom.with_drive("inner", replace(boom.drives[1], motor=weaker))
    report = check_cycle(boom, plan_cycle(boom, load_mission(str(tmp_path / "mission.toml")), step=study.case.step))
    shares = {f"used: {row.joint} {row.check}": usage(row) for row in report.rows if usage(row) is not None}
    assert len(shares) > 15
    assert {name: found[name] for name in shares} == pytest.approx(shares, rel=1e-12)
    assert found["duration_s"] == report.duration == 6.0
    assert found["drives_kg"] == pytest.approx(3.8 + 2.8 + 2 * 3.3)
    assert found["status"] == "done"


def test_an_unchanged_sample_is_the_mission_itself(loaded):
    study = loaded(("step_s = 0.1", ""), ('joints = ["inner"]', ""))
    found = compute(study.case, (10.0, 1.0))
    report = check_cycle(Boom.load(), planned_mission("table-3-1"))
    assert found["verdict"] == report.verdict
    tip = next(row for row in report.rows if row.check == "deflection in all")
    assert found["tip_error_m"] == tip.demand
    for row in report.rows:
        assert found.get(f"margin: {row.joint} {row.check}") == row.margin
    assert report.energy is not None
    assert (found["energy_J"], found["peak_W"]) == (report.energy.drawn, report.energy.peak_W)


def test_energy_lost_is_the_sum_of_all_losses(loaded):
    """In windings, gears, friction, drivers and brake resistor, each integrated on its own."""
    more = (
        '[boom.joints.inner.friction]\nviscous_Nm_s_per_rad = 3.0\ncoulomb_Nm = 2.0\nbasis = "assumed"\nsource = "this test"\n'
    )
    case = loaded(more=more).case
    boom, mission, _ = make(case, (10.0, 1.0))
    cycle = plan_cycle(boom, mission, step=case.step)
    evaluation = at_samples(boom, cycle.trajectory)
    powers = [power for power in joint_powers(evaluation) if power.electrical is not None]
    shafts = [power.output + power.rotor + power.gear_loss + power.copper for power in powers]
    losses = sum(power.friction + power.gear_loss + power.copper for power in powers)
    losses = losses + sum(np.maximum(s / 0.9 - s, 0.0) + np.maximum(0.9 * s - s, 0.0) for s in shafts)
    losses = losses + np.maximum(-sum(power.electrical for power in powers), 0.0)
    found = compute(case, (10.0, 1.0))
    rotors = np.trapezoid(sum(power.rotor for power in powers), evaluation.t)
    assert abs(rotors) < 1e-6 * found["lost_J"]  # they start and end at rest
    assert found["lost_J"] == pytest.approx(np.trapezoid(losses, evaluation.t), rel=1e-6)
    assert 0.0 < found["lost_J"] < found["energy_J"]


def test_what_makes_no_boom_is_a_row_with_its_reason(loaded):
    study = loaded()
    found = compute(study.case, (10.0, -0.5))
    assert found["status"] == "refused"
    assert "mass_kg" in found["reason"]
    assert found["verdict"] is None
    payload = compute(study.case, (-1.0, 1.0))
    assert payload["status"] == "refused"
    assert "payload is -1 kg" in payload["reason"]


def test_a_move_that_cannot_be_planned_fails_with_its_reason(loaded):
    more = factor("time", '["mission.steps.0.duration_s"]', "values = [5.0, 2.0]")
    found = compute(loaded(more=more).case, (10.0, 1.0, 2.0))
    assert (found["status"], found["verdict"]) == ("infeasible", "FAIL")
    assert "2 s" in found["reason"]


def test_a_profile_reaches_every_move(loaded):
    more = factor("profile", '["profile"]', 'values = "all"')
    study = loaded(("table-3-1", "field-day"), more=more)
    assert study.design.factors[-1].levels == tuple(map(str, SHORTEST))
    _, mission, _ = make(study.case, (10.0, 1.0, "time-optimal"))

    def profiles(steps):
        for step in steps:
            if step.to is not None:
                yield step.profile
            yield from profiles(step.steps)

    assert set(profiles(mission.table.steps)) == {"time-optimal"}
    assert parse_toml(mission_file("field-day"))["steps"][1]["profile"] == "jerk-limited"


def test_a_placeholder_is_filled(loaded):
    ends = 'start = "tip={reach},0,0.7"\ngoal = "tip={reach},0,1.0"\nconstraint = "extension=0.25"'
    move = f'[move]\n{ends}\n\n[[factors]]\nname = "payload"'
    study = loaded(
        ('mission = "table-3-1"\n', ""),
        ('[[factors]]\nname = "payload"', move),
        more='[[factors]]\nname = "reach"\nvalues = [1.4]\nsource = "this test"\n',
    )
    _, mission, _ = make(study.case, (10.0, 1.0, 1.4))
    assert (mission.table.start, mission.table.steps[0].to) == ("tip=1.4,0,0.7", "tip=1.4,0,1.0")


def test_the_probability_of_a_hold_is_the_normal_one(loaded, tmp_path):
    """A hold's torque is linear in the masses, so it is normal where they are; the rating is set to
    be passed in 3 of 10."""
    transport = Boom.load().pose("transport")
    heavier = Boom.load().with_payload(11.0)
    at = [abs(gravity_torque(b, transport)[1]) for b in (Boom.load(), heavier)]
    slope = (at[1] - at[0]) * 1.5  # of a deviation of 1.5 kg
    rating = at[0] + 0.5244 * slope
    (tmp_path / "hold.toml").write_text(
        'name = "hold"\nbasis = "assumed"\nsource = "this test"\nstart = "transport"\n[[steps]]\nhold_s = 5\n'
    )
    study = loaded(
        ('mission = "table-3-1"', f'mission = "{tmp_path}/hold.toml"'),
        ("std = 1.0", "std = 1.5"),
        ("low = 0.9\nhigh = 1.1", "low = 0.999999999\nhigh = 1.000000001"),
        ("monte-carlo", "sobol"),
        ("samples = 8", "samples = 256"),
        more=f"[catalogue.gearboxes.CBG320160]\nmax_average_torque_Nm = {rating}\ncontinuous_torque_Nm = 100.0\n",
    )
    rows = [compute(study.case, study.design.values(i)) for i in range(study.design.first, len(study.design))]
    share = np.mean([row["verdict"] == "FAIL" for row in rows])
    exact = norm.sf((rating / (1.0 - SAMPLING_SLACK) - at[0]) / slope)
    assert share == pytest.approx(exact, abs=0.01)
    assert {row["failing"] for row in rows} == {"", "inner gearbox hold"}


def test_first_order_propagation_agrees_with_the_samples_of_tolerance(tmp_path):
    """Its responses are almost linear in its factors.

    128 points of Sobol's sequence give a deviation to 2 %.
    """
    text = named_file(NAMED_STUDIES, "tolerance", "study").read_text()
    for old, new in (('"sobol-indices"', '"sobol"'), ("samples = 512", "samples = 128")):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "t.toml").write_text(text)
    store = Store(tmp_path / "t.parquet", load_study(str(tmp_path / "t.toml")))
    with store.opened(resume=False):
        run(store, workers=1)
        store.join(tmp_path / "t.parquet")
    results = Results(store.study, tmp_path / "t.parquet")
    for name in ("used", "energy_J", "mass_kg", "used: inner motor torque", "used: lower motor speed", "tip_error_m"):
        found = results.summary(name)
        assert found.deviation == pytest.approx(found.first_order, rel=0.05), name


def test_a_designed_link_is_the_one_that_the_link_command_designs():
    """The same body as `design_link` gives for the same loads."""
    boom, cycle = Boom.load(), planned_mission("table-3-1")
    task = link_task({"link": "inner", "slices": 100, "deflection": 0.01})
    assert link_task({"link": "none"}) is None is link_task({})
    made, mass = with_designed_link(boom, task, parse_toml(LINKS_FILE), cycle)
    other = design_link(boom, LinkTask(slices=100), [leg.trajectory for leg in cycle.legs])
    assert mass == pytest.approx(other.body.mass, rel=1e-12)
    np.testing.assert_allclose(made.bodies["inner"].inertia, other.body.inertia, rtol=1e-12, atol=1e-15)
    with pytest.raises(InputError, match=r"link\.material is 3"):
        link_task({"material": 3})
