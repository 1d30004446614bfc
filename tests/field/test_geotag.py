"""Geotags of points on a moving body: exact motions, Monte Carlo, and logs with holes."""

import numpy as np
import pymap3d
import pytest

from boom_model import InputError
from planner.field import attitude
from planner.field.earth import LocalFrame, geodetic_of
from planner.field.geotag import Latencies, LeverArm, clock_doubts, geotag
from planner.field.vehicle_log import VehicleLog
from tests.field.motions import SASKATOON, Drive

ANTENNA, SENSOR = np.array([0.2, -0.1, 2.9]), np.array([0.4, 2.4, 0.9])
T = np.arange(0.0, 40.0, 0.05)
TRIGGERS = np.arange(1.0, 38.0, 0.251)


@pytest.mark.parametrize("place", [(52.13, -106.62), (-42.9, 147.3), (-17.0, 179.9999), (52.0, -108.0), (89.9999, 0.0)])
def test_points_of_an_exact_motion(place):
    """Linear interpolation errs by a dt^2 / 8: 34 urad of attitude on 3.5 m of lever arm; a cubic
    of position hardly at all."""
    drive = Drive(frame=LocalFrame.at(*np.radians(place), 300.0))
    for velocity, at_antenna, at_sensor in ((False, 1.5e-4, 2e-4), (True, 1e-6, 1.5e-4)):
        found = geotag(_exact_log(drive, velocity), {"antenna": np.zeros(3), "sensor": SENSOR - ANTENNA}, TRIGGERS)
        for name, r, bound in (("antenna", ANTENNA, at_antenna), ("sensor", SENSOR, at_sensor)):
            assert found[name].known.all()
            assert np.linalg.norm(found[name].ecef - drive.point(TRIGGERS, r), axis=-1).max() < bound


def _exact_log(drive, velocity):
    """The log with headings from the north of each fix, which near a pole is not that
    of the frame."""
    log = drive.log(T, ANTENNA, velocity=velocity)
    latitude, longitude, height = geodetic_of(log.ecef)
    R_ecef_body = drive.frame.R_ecef_enu @ attitude.rotation(*drive.angles(T).T)
    angles = attitude.angles(np.swapaxes(log.R_ecef_enu, -1, -2) @ R_ecef_body)
    speeds = None if log.velocity is None else np.einsum("nji,nj->ni", log.R_ecef_enu, _rates(drive))
    return VehicleLog.of(T, latitude, longitude, height, *angles.T, velocity=speeds)


def _rates(drive):
    return (drive.point(T + 1e-4, ANTENNA) - drive.point(T - 1e-4, ANTENNA)) / 2e-4


def test_at_a_fix_it_is_pymap3ds_lever_arm():
    log = Drive().log(T, ANTENNA)
    found = geotag(log, {"a": SENSOR - ANTENNA, "b": [0.0, 0.0, -2.9]}, T[5:6])
    latitude, longitude, height = geodetic_of(log.ecef[5])
    for name, lever in (("a", SENSOR - ANTENNA), ("b", np.array([0.0, 0.0, -2.9]))):
        east, north, up = attitude.rotation(*log.angles[5]) @ lever
        theirs = pymap3d.enu2geodetic(east, north, up, np.degrees(latitude), np.degrees(longitude), height)
        ours = [np.degrees(found[name].geodetic[0][0]), np.degrees(found[name].geodetic[1][0]), found[name].geodetic[2][0]]
        assert ours[:2] == pytest.approx(theirs[:2], abs=1e-11)  # 1 um
        assert ours[2] == pytest.approx(theirs[2], abs=1e-6)


def test_one_antenna_predicts_the_others():
    """The log of one antenna gives those of two more on the same body."""
    others = {"left": np.array([-1.0, 0.8, 2.5]), "front": np.array([2.0, 0.0, 1.2])}
    found = geotag(Drive().log(T, ANTENNA, velocity=True), {name: r - ANTENNA for name, r in others.items()}, TRIGGERS)
    for name, r in others.items():
        assert np.linalg.norm(found[name].ecef - Drive().point(TRIGGERS, r), axis=-1).max() < 1.5e-4


def test_latencies_are_taken_off():
    log = Drive().log(T, ANTENNA, velocity=True, late=0.1)
    true = Drive().point(TRIGGERS - 0.03, SENSOR)
    late = Latencies(position=0.1, attitude=0.1, trigger=0.03)
    lever = {"s": SENSOR - ANTENNA}
    assert np.linalg.norm(geotag(log, lever, TRIGGERS, late)["s"].ecef - true, axis=-1).max() < 1.5e-4
    ignored = np.linalg.norm(geotag(log, lever, TRIGGERS, Latencies(trigger=0.03))["s"].ecef - true, axis=-1)
    assert np.mean(ignored) == pytest.approx(1.4 * 0.1, rel=0.06)  # speed times delay; the tip has its own speed, too


def test_velocity_is_the_points_own():
    drive, lever = Drive(), {"s": SENSOR - ANTENNA}
    found = geotag(drive.log(T, ANTENNA, velocity=True), lever, TRIGGERS)["s"]
    theirs = (drive.point(TRIGGERS + 1e-4, SENSOR) - drive.point(TRIGGERS - 1e-4, SENSOR)) / 2e-4 @ SASKATOON.R_ecef_enu
    assert found.velocity == pytest.approx(theirs, abs=1.5e-2)  # the attitude's rate is constant between fixes


@pytest.mark.parametrize("seed", range(10))
def test_covariance_equals_monte_carlo(seed):
    """The whole chain evaluated on 100,000 samples of every error, on random rigs."""
    random, count = np.random.default_rng(seed), 100_000
    antenna, lever = random.uniform(-1.0, 1.0, 3), random.uniform(-2.5, 2.5, 3)
    angles = random.uniform([-0.2, -0.2, 0.0], [0.2, 0.2, 6.28])
    v, rate = random.uniform(-1.5, 1.5, 3) * [1, 1, 0.1], random.uniform(-0.5, 0.5, 3)
    spin = random.uniform(-0.2, 0.2, 3)  # of roll, pitch, heading [rad/s]
    P, S, C = (_covariance(random, size) for size in (0.02, 0.003, 0.01))
    late = Latencies(position_std=0.008, attitude_std=0.02, joints_std=0.01, trigger_std=0.005)
    t, at = np.arange(-1.0, 1.0, 0.002), np.array([0.0003])
    frame = SASKATOON
    log = VehicleLog.of(
        t, *geodetic_of(frame.ecef(antenna + v * t[:, None])), *(angles + spin * t[:, None]).T,
        velocity=np.tile(v, (len(t), 1)), position_covariance=P, attitude_covariance=S,
    )  # fmt: skip
    found = geotag(log, {"s": LeverArm.of(lever, C, rate)}, at, late)["s"]

    stamp, fix, turn, joint = (
        random.normal(0.0, std, count) for std in (late.trigger_std, late.position_std, late.attitude_std, late.joints_std)
    )
    position = antenna + v * (at + stamp + fix)[:, None] + random.multivariate_normal(np.zeros(3), P, count)
    attitudes = angles + spin * (at + stamp + turn)[:, None] + random.multivariate_normal(np.zeros(3), S, count)
    arm = lever + rate * (stamp + joint)[:, None] + random.multivariate_normal(np.zeros(3), C, count)
    samples = position + np.einsum("nij,nj->ni", attitude.rotation(*attitudes.T), arm)
    theirs = np.cov(samples.T)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    assert np.abs(found.covariance[0] - theirs).max() < 0.03 * scale.max()
    assert (np.abs(found.covariance[0] - theirs) / scale).max() < 0.03
    assert frame.enu(found.ecef[0]) == pytest.approx(samples.mean(axis=0), abs=1e-3)

    centred = samples[:, :2] - frame.enu(found.ecef[0])[:2]
    distance = np.einsum("ni,ij,nj->n", centred, np.linalg.inv(found.covariance[0, :2, :2]), centred)
    assert 0.94 < np.mean(distance < 5.991464547107979) < 0.96
    a, b, bearing = found.ellipses[0]
    along, across = centred @ [np.sin(bearing), np.cos(bearing)], centred @ [np.cos(bearing), -np.sin(bearing)]
    assert 0.94 < np.mean((along / a) ** 2 + (across / b) ** 2 < 1.0) < 0.96


def _covariance(random, size):
    half = random.normal(0.0, size, (3, 3))
    return half @ half.T / 3.0 + np.eye(3) * (0.2 * size) ** 2


def test_simulated_field_errs_as_predicted():
    """20 Hz RTK with white noise: half-way between fixes noise averages out, so the prediction is
    an upper bound."""
    drive = Drive()
    found = geotag(drive.log(T, ANTENNA, 0.0143, np.radians(0.1), velocity=False, seed=4), {"s": SENSOR - ANTENNA}, T[20:-20])
    off = (found["s"].ecef - drive.point(T[20:-20], SENSOR)) @ SASKATOON.R_ecef_enu
    rms, predicted = np.sqrt((off**2).mean(axis=0)), np.sqrt(np.diagonal(found["s"].covariance, axis1=1, axis2=2).mean(axis=0))
    assert rms == pytest.approx(predicted, rel=0.08)


# Logs with holes


def test_gaps_jumps_and_ends_have_no_position():
    keep = (T < 10.0) | (T > 12.0)
    log = Drive().log(T[keep], ANTENNA, 0.002)
    moved = log.ecef.copy()
    moved[log.t > 20.0] += SASKATOON.R_ecef_enu @ [1.5, 0.0, 0.0]
    log = VehicleLog.of(log.t, *geodetic_of(moved), *log.angles.T, position_covariance=4e-6, source="log.csv")
    assert len(log.warnings) == 2
    assert log.warnings[0].startswith("log.csv: gap of 2.1")
    assert log.warnings[1].startswith("log.csv: jump of 1.")
    found = geotag(log, {"s": [0.0, 0.0, 0.0]}, [-1.0, 5.0, 11.0, 20.03, 25.0, 50.0])["s"]
    assert list(found.known) == [False, True, False, False, True, False]
    assert "before log.csv begins" in found.reasons[0]
    assert "in a gap of" in found.reasons[2]
    assert "in a jump of" in found.reasons[3]
    assert "after log.csv ends" in found.reasons[5]
    assert np.isnan(found.ecef[2]).all()


def test_loss_of_the_fix_is_named_by_its_lines():
    """Fixed but for two stretches; NMEA's 5 is a float solution, 1 a single one."""
    exact, quality = Drive().log(T, ANTENNA), np.full(len(T), 4)
    quality[100:120], quality[300] = [5] * 15 + [1] * 5, 2
    log = VehicleLog.of(T, *exact.geodetic, *exact.angles.T, quality=quality, lines=np.arange(len(T)) + 2, source="log.csv")
    assert log.warnings == (
        "log.csv: the fix is RTK float, single on lines 102 to 121, 0.95 s",
        "log.csv: the fix is differential on line 302, 0 s",
    )
    same = VehicleLog.of(T, *exact.geodetic, *exact.angles.T, quality=np.full(len(T), 2))
    assert same.warnings == ()


def test_noise_is_no_jump():
    for seed in range(20):
        assert not Drive().log(T, ANTENNA, 0.015, 1e-3, seed=seed).warnings


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t": [0.0, 1.0, 0.5]}, "line 3: the time goes back by 0.5 s"),
        ({"t": [0.0, 1.0, 1.0]}, "line 3: the time repeats"),
        ({"latitude": [0.9, 0.9, 1.8]}, "line 3: latitude is 103.1.* between -90 and 90 deg"),
        ({"height": [0.0, 1e5, 0.0]}, "line 2: height is 100000 m"),
        ({"roll": [0.0, 0.0, 2.0]}, "line 3: roll is"),
        ({"height": [0.0, np.nan, 0.0]}, r"height\[1\] is nan"),
        ({"position_covariance": -np.eye(3)}, "negative eigenvalue"),
        ({"position_covariance": np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]])}, "not symmetric"),
        ({"velocity": np.full((3, 3), 200.0)}, "line 1: velocity is 200 m/s"),
        ({"t": [0.0, 1.0]}, "it must be"),
    ],
)
def test_refused_logs(change, message):
    given = {"t": [0.0, 1.0, 2.0], "latitude": np.full(3, 0.9), "longitude": np.zeros(3), "height": np.zeros(3),
             "roll": np.zeros(3), "pitch": np.zeros(3), "heading": np.zeros(3)}  # fmt: skip
    with pytest.raises(InputError, match=message):
        VehicleLog.of(**{**given, **change})


def test_refused_times_and_lever_arms():
    log = Drive().log(T, ANTENNA)
    with pytest.raises(InputError, match=r"must be \(n,\)"):
        geotag(log, {}, 3.0)
    with pytest.raises(InputError, match=r"lever arm s has shape \(3, 3\)"):
        geotag(log, {"s": np.zeros((3, 3))}, [1.0, 2.0])


def test_headings_in_radians_or_from_east_are_noticed():
    log = Drive(begin=2.0, turning=1e-3).log(T, ANTENNA)
    for angle, said in (
        (np.radians(log.angles[:, 2]), "radians written as degrees"),
        (np.pi / 2 - log.angles[:, 2], "from east"),
    ):
        odd = VehicleLog.of(T, *log.geodetic, *log.angles[:, :2].T, angle)
        assert said in odd.warnings[0]


def test_clocks_that_differ_are_noticed():
    t = np.arange(0.0, 600.0, 1.0) + 1.7e9
    assert clock_doubts("triggers", t, "log", t) == ()
    assert "GPS time" in clock_doubts("triggers", t + 18.0, "log", t)[0]
    assert "local time" in clock_doubts("triggers", t - 6 * 3600.0, "log", t)[0]
