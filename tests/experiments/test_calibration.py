"""Calibration of simulated machines: errors against what the noise allows, intervals, bad targets,
bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from boom_model import Basis, Boom, InfeasibleError, InputError, forward_kinematics, transmission_angle
from boom_model.calibration import INNER, LENGTHS, OFFSETS, SCALE, UPPER, WIND_UPS
from boom_model.tip_uncertainty import printed_wind_up
from planner.experiments.calibration import calibrate, rms
from planner.experiments.calibration_file import write_calibrated
from planner.experiments.calibration_model import (
    BASE,
    Frame,
    TipModel,
    candidates,
)
from planner.experiments.calibration_poses import suggest_poses
from planner.experiments.comparison import Log, compare
from planner.experiments.measurements import Measurements, read_measurements, write_poses
from planner.motion.trajectory import Trajectory

BOOM = Boom.load()
NOISE = 5e-4  # [m] of a coordinate


def poses(rng, count):
    """Poses within the limits, the linkage at least 20 deg from flat."""
    q = rng.uniform(BOOM.limits.lower, BOOM.limits.upper, (40 * count, 5))
    apart = np.degrees(q[:, 2] - q[:, 1])
    return q[BOOM.limits.contain(q) & (apart > 20.0) & (apart < 160.0)][:count]


def machine(rng, *, unequal=True):
    """A boom whose nine lengths are off by 2 mm and whose five zeros by 0.5 deg or 2 mm, seen from
    anywhere."""
    names = (*LENGTHS, *OFFSETS)
    off = {name: rng.choice([-2e-3, 2e-3]) for name in (*LENGTHS, OFFSETS[3])}
    off |= {name: rng.choice([-1.0, 1.0]) * np.radians(0.5) for i, name in enumerate(OFFSETS) if i != 3}
    # L5 and L9 are off by 2 mm themselves.
    off[UPPER], off[INNER] = (off[UPPER] - off["L3"], off[INNER] - off["L4"]) if unequal else (0.0, 0.0)
    model = TipModel.of(BOOM, np.zeros(3)).changed(names, np.array([off[name] for name in names]))
    frame = Frame(Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), 3.0 * rng.normal(size=3))
    return replace(model, frame=frame)


def true_tips(model, q):
    return model.tip(q, printed_wind_up(model.boom, model.joints(q, np.zeros_like(q))))


def measured(model, q, rng, noise=NOISE):
    return true_tips(model, q) + noise * rng.normal(size=(len(q), 3))


def calibrated(seed, **options):
    rng = np.random.default_rng(seed)
    model, q = machine(rng, unequal=options.pop("unequal", True)), poses(rng, 30)
    return model, calibrate(BOOM, Measurements.of(q, measured(model, q, rng), NOISE), **options), rng


def test_the_derivative_is_that_of_the_tip():
    rng = np.random.default_rng(0)
    model, q = machine(rng), poses(rng, 20)
    model = replace(model, target=np.array([0.05, -0.03, 0.02]))
    names, yields = candidates(BOOM, known_frame=False, equal_links=False), printed_wind_up(BOOM, q)
    J = model.derivative(names, q, yields)
    for k, name in enumerate(names):
        h = 1e-6
        more, less = (model.changed((name,), np.array([s * h])).tip(q, yields) for s in (1.0, -1.0))
        np.testing.assert_allclose(J[..., k], (more - less) / (2 * h), rtol=0, atol=3e-8, err_msg=name)
    by_readings = np.stack([(model.tip(q + 1e-6 * e, yields) - model.tip(q - 1e-6 * e, yields)) / 2e-6 for e in np.eye(5)], -1)
    np.testing.assert_allclose(model.by_readings(q, yields), by_readings, rtol=0, atol=3e-8)


def test_tips_that_were_not_measured_are_predicted_as_well_as_the_noise_allows_and_intervals_are_right():
    """Of 12 machines; 100 give 1.006 of what the noise allows in all, at most 1.42 for one, and
    94.7 % in 95 % intervals."""
    errors, allowed, inside, before, equal, off = [], [], [], [], [], []
    for seed in range(12):
        model, found, rng = calibrated(seed)
        q = poses(rng, 100)
        at, C = found.predicted(q)
        error = at - true_tips(model, q)
        errors.append(rms(error))
        allowed.append(np.sqrt(np.trace(C, axis1=1, axis2=2).mean()))
        inside.append((np.abs(error) < 1.96 * np.sqrt(np.diagonal(C, axis1=1, axis2=2))).mean())
        one = error[0] @ np.linalg.solve(C[0], error[0])
        off.append(one)
        before.append(rms(found.before))
        g = model.boom.geometry
        differ = max(abs(g.upper_less_lower), abs(g.inner_less_outer)) > 1e-9  # 2 mm off both may cancel
        equal += [found.equal_links_rms] if differ else []
        assert found.unequal == differ
        assert errors[-1] < 1.5 * allowed[-1]
    assert np.mean(before) > 0.015  # centimetres
    assert np.sqrt(np.square(errors).sum() / np.square(allowed).sum()) < 1.15
    assert np.mean(inside) == pytest.approx(0.95, abs=0.04)
    assert chi2.ppf(0.001, 36) < np.sum(off) < chi2.ppf(0.999, 36)
    assert min(equal) > 2.0 * np.sqrt(3.0) * NOISE  # forced equal links are visibly worse


def test_parameters_lie_in_their_intervals():
    """With the held parameters at their true values, (p - p_true)^T C^-1 (p - p_true) is
    chi-square."""
    squares, counts = [], []
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        fitted = ("L2", "L4", "L6", "L7", "L8", UPPER, INNER, "inner offset", "lower offset", "wrist offset")
        truth = TipModel.of(BOOM, np.zeros(3)).changed(fitted, rng.normal(size=10) * [2e-3] * 7 + [0.0] * 10)
        q = poses(rng, 30)
        held = [n for n in candidates(BOOM, known_frame=True, equal_links=False) if n not in fitted]
        tips = Measurements.of(q, measured(truth, q, rng), NOISE)
        found = calibrate(BOOM, tips, known_frame=True, linkage="unequal", held=held)
        assert set(found.free) == set(fitted)
        gap = found.model.values(found.free) - truth.values(found.free)
        squares.append(gap @ np.linalg.solve(found.covariance, gap))
        counts.append(len(gap))
    assert chi2.ppf(0.001, sum(counts)) < sum(squares) < chi2.ppf(0.999, sum(counts))


def test_without_stated_noise_the_same_intervals_come_from_the_residuals():
    rng = np.random.default_rng(4)
    model, q = machine(rng), poses(rng, 30)
    tips = measured(model, q, rng)
    stated, unknown = calibrate(BOOM, Measurements.of(q, tips, NOISE)), calibrate(BOOM, Measurements.of(q, tips))
    assert unknown.sd_factor * 1e-3 == pytest.approx(NOISE, rel=0.2)
    at, _ = stated.predicted(q)
    again, C = unknown.predicted(q)
    assert np.abs(at - again).max() < 2e-4
    assert np.sqrt(C[:, 0, 0]).mean() == pytest.approx(np.sqrt(stated.predicted(q)[1][:, 0, 0]).mean(), rel=0.2)


def test_equal_links_are_kept_where_they_are_equal():
    _, found, _ = calibrated(7, unequal=False)
    assert not found.unequal
    assert found.equal_links_chance > 0.01
    assert any("equal links are kept" in note for note in found.notes)


def test_what_the_data_cannot_tell_is_held_and_named():
    _, found, _ = calibrated(1)
    held = {p.name: p for p in found.parameters if p.sd is None}
    assert {"L1", "L3", "yaw offset", "extension offset"} <= set(held)
    assert held["extension offset"].alike == ("L7",)
    assert all(held[name].value == held[name].start for name in held)
    assert found.singular_values.min() >= 1.0
    assert set(BASE) <= set(found.free)
    rng = np.random.default_rng(2)
    q = poses(rng, 30)
    q[:, 4] = 0.3  # a wrist that never moves
    still = calibrate(BOOM, Measurements.of(q, measured(machine(rng), q, rng), NOISE))
    (wrist,) = (p for p in still.parameters if p.name == "wrist offset")
    assert wrist.sd is None


def test_bad_targets_are_left_out_by_name():
    rng = np.random.default_rng(11)
    model, q = machine(rng), poses(rng, 30)
    tips = measured(model, q, rng)
    clean = calibrate(BOOM, Measurements.of(q, tips, NOISE))
    tips[[3, 17]] += [[0.05, 0.0, 0.0], [0.0, -0.02, 0.01]]
    found = calibrate(BOOM, Measurements.of(q, tips, NOISE))
    assert list(np.flatnonzero(~found.used)) == [3, 17]
    assert any("pose 4 (" in note and "18 (" in note for note in found.notes)
    assert np.abs(found.predicted(q)[0] - clean.predicted(q)[0]).max() < 1e-3


def test_a_height_alone_counts_and_readings_may_be_noisy():
    rng = np.random.default_rng(12)
    model, q = machine(rng), poses(rng, 40)
    tips = measured(model, q, rng)
    tips[25:, :2] = np.nan
    found = calibrate(BOOM, Measurements.of(q + rng.normal(size=q.shape) * 1e-4, tips, NOISE, reading_sd=1e-4))
    test = poses(rng, 100)
    at, C = found.predicted(test)
    assert rms(at - true_tips(model, test)) < 1.5 * np.sqrt(np.trace(C, axis1=1, axis2=2).mean())
    assert found.sd_factor == pytest.approx(1.0, abs=0.3)


def test_the_held_out_error_is_that_of_fits_without_the_pose():
    rng = np.random.default_rng(13)
    model, q = machine(rng), poses(rng, 24)
    tips = measured(model, q, rng)
    found = calibrate(BOOM, Measurements.of(q, tips, NOISE), linkage="unequal")
    for pose in (0, 9):
        rest = np.arange(24) != pose
        without = calibrate(BOOM, Measurements.of(q[rest], tips[rest], NOISE), linkage="unequal")
        if without.free == found.free:
            np.testing.assert_allclose(found.held_out[pose], tips[pose] - without.predicted(q[pose])[0][0], atol=2e-4)


def test_the_written_boom_has_the_measured_figures_and_says_so(tmp_path):
    model, found, rng = calibrated(1)
    file = tmp_path / "mine.toml"
    write_calibrated(found, file, None, None)
    boom = Boom.load(file)
    assert boom.calibration.origin.basis is Basis.MEASURED
    assert "30 poses" in boom.calibration.origin.source
    np.testing.assert_allclose(boom.calibration.covariance, found.boom.calibration.covariance, rtol=1e-7)
    g, fitted = boom.geometry, found.boom.geometry
    np.testing.assert_allclose([g.L2, g.L4, g.L5, g.L9], [fitted.L2, fitted.L4, fitted.L5, fitted.L9], rtol=0, atol=1e-9)
    assert "# measured: standard deviation" in file.read_text(encoding="utf-8")
    assert "Centres of mass and inertias" in file.read_text(encoding="utf-8")  # comments stay
    # The file predicts what the calibration does: distances between tips do not depend on the
    # frame.
    q = poses(rng, 20)
    own = TipModel.of(boom, np.zeros(3))
    own_steps, true_steps = (np.linalg.norm(np.diff(true_tips(m, q), axis=0), axis=-1) for m in (own, model))
    np.testing.assert_allclose(own_steps, true_steps, rtol=0, atol=3e-3)
    again = calibrate(boom, Measurements.of(q, true_tips(model, q), NOISE))
    assert rms(again.before) < 3e-3


def test_compare_turns_readings_into_joint_positions(tmp_path):
    _, found, _ = calibrated(1)
    t, q = np.linspace(0.0, 1.0, 21), np.tile(BOOM.pose("transport"), (21, 1))
    motion = Trajectory.from_samples(t, q, np.zeros_like(q), np.zeros_like(q))
    read = found.boom.calibration.readings(q)
    log = Log.of(t, read, np.zeros_like(q), np.zeros_like(q))
    result = compare(found.boom, motion, log)
    np.testing.assert_allclose(result.joint_error, 0.0, rtol=0, atol=1e-12)
    assert any("offsets and scale of the readings are applied" in note for note in result.notes)


def test_suggested_poses_are_within_all_bounds_and_tell_more_than_random_ones():
    found = suggest_poses(BOOM, 20, tip_sd=NOISE, lowest=0.3)
    assert found.q.shape == (20, 5)
    assert BOOM.limits.contain(found.q).all()
    assert (transmission_angle(BOOM, found.q) >= BOOM.limits.transmission - 1e-9).all()
    assert (forward_kinematics(BOOM, found.q).position[:, 2] >= 0.3).all()
    assert found.gain > 1.1
    rng, best = np.random.default_rng(3), suggest_poses(BOOM, 20, tip_sd=NOISE).q
    model, held = machine(rng), (*WIND_UPS[1:3], SCALE)
    fits = [
        calibrate(BOOM, Measurements.of(q, measured(model, q, rng), NOISE), linkage="unequal", held=held)
        for q in (best, *(poses(rng, 20) for _ in range(4)))
    ]
    assert len({fit.free for fit in fits}) == 1
    volumes = [np.linalg.slogdet(fit.covariance)[1] for fit in fits]
    assert volumes[0] < min(volumes[1:])
    with pytest.raises(InfeasibleError, match="random poses are within the limits"):
        suggest_poses(BOOM, 20, tip_sd=NOISE, lowest=5.0)


HEADER = "q1,q2,q3,q4,q5,x,y,z\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("q1,q2,q3,q4,q5,x,y\n0,0,1,0,0,1,1\n", "column z is missing"),
        (HEADER, "has no pose; measure the tip in at least 10 poses"),
        (HEADER + "0,60,180,0,0,1,1,1\n", r"q2 \(inner\) looks like degrees: it reaches 60"),
        (HEADER + "0,0,1,500,0,1,1,1\n", r"q4 \(extension\) looks like millimetres"),
        (HEADER + "0,0,1,0,0,1000,1,1\n0,0,1,0,0,2000,1,1\n", "x looks like millimetres: the tips are 1000 apart"),
        (HEADER + "0,0,1,0,0,,,\n", "pose 1 has no coordinate; measure one of x, y, z, or leave it out"),
        (HEADER + "0,,1,0,0,1,1,1\n", "q2 is empty in pose 1"),
        (HEADER + "0,a,1,0,0,1,1,1\n", "not a CSV of measurements"),
        (
            "q1,q2,q3,q4,q5,x,y,z,sx,sy,sz\n0,0,1,0,0,1,1,1,0,1,1\n",
            "standard deviation of the tip is 0 m; it must be above 0 m",
        ),
        ("q1,q2,q3,q4,q5,x,y,z,sx,sy,sz\n0,0,1,0,0,1,1,1,1,1,1\n", "looks like millimetres: it is 1; it must be in m"),
    ],
)
def test_a_bad_file_is_refused_with_what_is_wrong(tmp_path, text, message):
    file = tmp_path / "measured.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_measurements(file)


def test_too_little_data_is_refused_with_what_to_measure(tmp_path):
    rng = np.random.default_rng(5)
    model, q = machine(rng), poses(rng, 30)
    tips = measured(model, q, rng)
    with pytest.raises(InputError, match="5 poses with 15 coordinates are too few; measure at least 10 poses, better 30"):
        calibrate(BOOM, Measurements.of(q[:5], tips[:5], NOISE))
    with pytest.raises(InputError, match="no joint moves; measure poses that differ in every joint"):
        calibrate(BOOM, Measurements.of(np.tile(q[0], (30, 1)), tips, NOISE))
    with pytest.raises(InputError, match=r"0 poses have all of x, y and z; .* needs 3"):
        calibrate(BOOM, Measurements.of(q, np.where([True, True, False], np.nan, tips), NOISE))
    with pytest.raises(InputError, match="unknown parameter 'L17'"):
        calibrate(BOOM, Measurements.of(q, tips, NOISE), held=["L17"])
    flat = q.copy()
    flat[4, 1:3] = 0.0, np.pi
    with pytest.raises(InputError, match=r"pose 5: lower - inner is 180 deg, where the linkage is flat; .*--linkage equal"):
        calibrate(BOOM, Measurements.of(flat, tips, NOISE))
    write_poses(tmp_path / "poses.csv", q)
    with pytest.raises(InputError, match="pose 1 has no coordinate"):
        read_measurements(tmp_path / "poses.csv")


ANCHORS = np.array([[2.0, 0.0, 0.2], [-1.0, 2.0, 0.0], [-1.0, -2.0, 0.5]])
"""Fixed points for a tape, as somebody places them in frame 1."""


def taped(rng, boom, offset, q, place):
    """Rows of a file: readings, distance from each anchor, anchor.

    The boom stands a little elsewhere than it is thought to.
    """
    at = q - printed_wind_up(boom, q)
    tips = forward_kinematics(boom, at).position @ place[0].T + place[1]
    rows = []
    for anchor in ANCHORS:
        d = np.linalg.norm(tips - anchor, axis=-1) + NOISE * rng.normal(size=len(q))
        rows.append(np.column_stack([q - offset, d, np.tile(anchor, (len(q), 1))]))
    return np.concatenate(rows)


def test_a_tape_from_three_points_calibrates_as_well_as_its_noise_allows(tmp_path):
    rng = np.random.default_rng(23)
    lengths = {"L2": 0.0315, "L4": 1.002, "L7": 0.7575, "upper_less_lower": 0.002, "inner_less_outer": -0.002}
    true = replace(BOOM, geometry=replace(BOOM.geometry, **lengths))
    offset = np.array([0.0, 0.006, -0.008, 0.0, 0.01])
    place = Rotation.from_euler("xyz", [2.0, -1.0, 4.0], degrees=True).as_matrix(), np.array([0.1, -0.05, 0.08])
    for name, q in (("tape.csv", suggest_poses(BOOM, 30, tip_sd=NOISE).q), ("others.csv", poses(rng, 15))):
        rows = taped(rng, true, offset, q, place)
        header = "q1,q2,q3,q4,q5,d,ax,ay,az"
        np.savetxt(tmp_path / name, rows, delimiter=",", header=header, comments="", fmt="%.9g")
    found = calibrate(BOOM, read_measurements(tmp_path / "tape.csv", NOISE))
    check = found.checked_on(read_measurements(tmp_path / "others.csv", NOISE))
    assert check.before > 8.0 * check.after
    assert check.after < 1.5 * check.expected
    values = {p.name: (p.value, p.sd) for p in found.parameters if p.sd is not None}
    for name, true_value in (
        (UPPER, 0.002),
        (INNER, -0.002),
        ("inner offset", 0.006),
        ("lower offset", -0.008),
        ("L2", 0.0315),
    ):
        value, sd = values[name]
        assert abs(value - true_value) < 4.0 * sd
    assert any("measured by their distance" in note for note in found.notes)


@pytest.mark.parametrize(
    ("header", "row", "said"),
    [
        ("q1,q2,q3,q4,q5,d", "0,1,2,0,0,1.5", "column ax is missing"),
        ("q1,q2,q3,q4,q5,ax,ay,az", "0,1,2,0,0,1,1,1", "column d is missing"),
        ("q1,q2,q3,q4,q5,d,ax,ay,az", "0,1,2,0,0,1.5,1,,0", "has a distance d, but not all of ax, ay, az"),
        (
            "q1,q2,q3,q4,q5,d,ax,ay,az",
            "0,1,2,0,0,1500,1,0,0",
            "distance of pose 1 is 1500; it must be above 0 and at most 100 m",
        ),
        ("q1,q2,q3,q4,q5,x,y,z,d,ax,ay,az", "0,1,2,0,0,1,1,1,1.5,1,0,0", "pose 1 has a distance and coordinates"),
    ],
)
def test_a_wrong_tape_is_named(tmp_path, header, row, said):
    (tmp_path / "tape.csv").write_text(f"{header}\n{row}\n")
    with pytest.raises(InputError, match=said):
        read_measurements(tmp_path / "tape.csv")


def slipped(change):
    """Measurements of the shipped boom in another frame, with a slip."""
    rng = np.random.default_rng(31)
    q = poses(rng, 24)
    R, t = Rotation.from_euler("xyz", [2.0, -1.0, 130.0], degrees=True).as_matrix(), np.array([3.0, 2.0, 0.4])
    tip = forward_kinematics(BOOM, q - printed_wind_up(BOOM, q)).position @ R.T + t + NOISE * rng.normal(size=(24, 3))
    return Measurements.of(*change(q, tip), NOISE, name="tips.csv")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda q, x: (q * [1, -1, 1, 1, 1], x), r"q2 \(inner\) looks turned round: multiply it by -1"),
        (lambda q, x: (q[:, [0, 2, 1, 3, 4]], x), "look swapped"),
        (lambda q, x: (q, np.roll(x, 1, axis=0)), "each tip looks like that of the row one earlier"),
        (lambda q, x: (q, x * [1, -1, 1]), "multiply it by -1, or make the measuring frame right-handed"),
        (lambda q, x: (q, x * 3.28084), "look like feet; they must be in m"),
        (lambda q, x: (q, x[np.random.default_rng(1).permutation(len(x))]), "check the units, the signs of the joints"),
    ],
)
def test_a_slip_is_named_instead_of_fitted(change, said):
    with pytest.raises(InputError, match=said):
        calibrate(BOOM, slipped(change))


def test_a_joint_that_never_moves_is_named():
    def fixed(q, x):
        at = np.array(q)
        at[:, 4] = 0.3
        return at, forward_kinematics(BOOM, at - printed_wind_up(BOOM, at)).position

    found = calibrate(BOOM, slipped(fixed), known_frame=True)
    assert "wrist never moves (all at 17.19 deg): measure poses that differ in it, too (--suggest)" in found.notes
    assert "wrist offset" not in found.free or "L8" not in found.free
