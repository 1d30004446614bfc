"""A log from several antennas: exact motions, the covariance of its attitude against samples, and
geotags of further points."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boom_model import InputError
from planner.field import attitude
from planner.field.antennas import log_of_antennas
from planner.field.geotag import geotag
from tests.field.motions import SASKATOON, Drive

PLACES = {"left": np.array([-1.0, 0.8, 2.5]), "right": np.array([-1.1, -0.8, 2.5]), "front": np.array([2.0, 0.1, 1.6])}
T = np.arange(0.0, 10.0, 0.05)
DRIVE = Drive(turning=0.1, sway=0.05)


def test_three_antennas_give_position_and_attitude():
    log, middle = log_of_antennas(T, {name: DRIVE.point(T, r) for name, r in PLACES.items()}, PLACES, 0.01)
    assert log.angles == pytest.approx(DRIVE.angles(T), abs=1e-5)  # north turns by 1e-6 rad over these metres
    points = {"hitch": np.array([-2.0, 0.0, 0.4]), "tip": np.array([1.0, 3.0, 0.5])}
    found = geotag(log, {name: r - middle for name, r in points.items()}, T[10:-10])
    for name, r in points.items():
        assert np.linalg.norm(found[name].ecef - DRIVE.point(T[10:-10], r), axis=-1).max() < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_covariance_of_a_point_equals_samples(seed):
    """Antennas at random places, each coordinate wrong by 10 mm in 40,000 samples; Wahba's problem
    solved by another way."""
    random, count, std = np.random.default_rng(seed), 40_000, 0.01
    places = {str(k): random.uniform(-1.5, 1.5, 3) for k in range(4)}
    point, t = random.uniform(-2.0, 2.0, 3), np.array([0.0, 1.0])
    drive = Drive(turning=1e-6, sway=0.05, begin=random.uniform(0.0, 6.0))
    exact = {name: drive.point(t, r) for name, r in places.items()}
    log, middle = log_of_antennas(t, exact, places, std)
    (claimed,) = geotag(log, {"p": point - middle}, t[:1])["p"].covariance
    enu = np.stack([SASKATOON.enu(each[0]) for each in exact.values()])
    noisy = enu + random.normal(0.0, std, (count, *enu.shape))
    body = np.stack(list(places.values())) - middle
    U, _, Vt = np.linalg.svd(np.einsum("nki,kj->nij", noisy - noisy.mean(axis=1, keepdims=True), body))  # Kabsch
    R = U @ (np.stack([np.ones(count), np.ones(count), np.linalg.det(U @ Vt)], axis=-1)[:, :, None] * Vt)
    theirs = np.cov((noisy.mean(axis=1) + R @ (point - middle)).T)
    scale = np.sqrt(np.outer(np.diag(theirs), np.diag(theirs)))
    assert (np.abs(claimed - theirs) / scale).max() < 0.04


def test_two_antennas_are_level_about_their_line():
    """Across the vehicle they give heading and roll; pitch is taken as level, and said to be."""
    places = {"left": np.array([0.0, 0.9, 2.0]), "right": np.array([0.0, -0.9, 2.0])}
    log, _ = log_of_antennas(T, {name: DRIVE.point(T, r) for name, r in places.items()}, places, 0.01)
    true = DRIVE.angles(T)
    assert log.angles[:, 0] == pytest.approx(true[:, 0], abs=2e-4)  # pitch of 0.05 rad turns it by its square
    assert np.abs((log.angles[:, 2] - true[:, 2] + np.pi) % (2.0 * np.pi) - np.pi).max() < 0.06 * 0.06
    assert log.angles[:, 1] == pytest.approx(np.zeros(len(T)), abs=1e-9)
    std = np.sqrt(np.diagonal(log.attitude_covariance[0]))
    assert std == pytest.approx([0.01 * np.sqrt(2.0) / 1.8, np.radians(3.0), 0.01 * np.sqrt(2.0) / 1.8], rel=0.01)
    assert any("assumed level about it" in note for note in log.notes)


def test_a_tilted_body_of_three_antennas_keeps_its_sense():
    turned = Rotation.from_euler("xyz", [0.4, -0.3, 2.0]).as_matrix()
    enu = {name: np.tile(turned @ r, (2, 1)) for name, r in PLACES.items()}
    log, _ = log_of_antennas([0.0, 1.0], {name: SASKATOON.ecef(each) for name, each in enu.items()}, PLACES, 0.01)
    assert attitude.rotation(*log.angles[0]) == pytest.approx(turned, abs=2e-6)


@pytest.mark.parametrize(("places", "message"), [
    ({"a": [0.0, 0.0, 0.0]}, "two antennas or more"),
    ({"a": [0.0, 0.0, 0.0], "b": [0.0, 0.001, 0.0]}, "are 0.000707 m apart"),
    ({"a": [0.0, 0.0, 0.0], "b": [0.0, 0.0, 1.0]}, "tells no heading"),
])  # fmt: skip
def test_refused(places, message):
    positions = {name: DRIVE.point(T, np.array(r)) for name, r in places.items()}
    with pytest.raises(InputError, match=message):
        log_of_antennas(T, positions, places, 0.01)
    with pytest.raises(InputError, match="need both"):
        log_of_antennas(T, positions, {**places, "c": [1.0, 1.0, 1.0]}, 0.01)
