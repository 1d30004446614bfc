"""A field day as files: a vehicle that drives past plots, its boom that sweeps, and what sees what,
known exactly."""

from pathlib import Path

import numpy as np

from boom_model import Boom, forward_kinematics
from boom_model.arrays import Array
from planner.field import attitude
from planner.field.earth import geodetic_of
from tests.field.motions import SASKATOON, Drive

RIG = """
name = "swather"

[antenna]
position_m = [0.2, -0.1, 2.9]
std_m = 0.003
basis = "printed"
source = "a test"

[imu]
heading_deg = 1.5
std_deg = 0.05
basis = "printed"
source = "a test"

[mount]
position_m = [1.2, 0.6, 0.5]
heading_deg = -2.0
std_m = 0.002
std_deg = 0.05
basis = "printed"
source = "a test"

[joints]
std_deg = 0.02
extension_std_m = 0.0005
latency_s = 0.01
basis = "printed"
source = "a test"

[sensor]
position_m = [0.05, 0.02, -0.03]
std_m = 0.001
footprint_m = [0.4, 0.6]
range_m = 1.0
latency_s = 0.02
basis = "printed"
source = "a test"

[ground]
height_m = -0.4
canopy_m = 0.8
std_m = 0.03
basis = "assumed"
source = "a level field of wheat"
"""

ANTENNA, MOUNT, SENSOR = np.array([0.2, -0.1, 2.9]), np.array([1.2, 0.6, 0.5]), np.array([0.05, 0.02, -0.03])

POSITION_STD = np.array([0.014, 0.014, 0.02])


def joint_position(t: Array) -> Array:
    """(n, 5) a slow sweep of the arm, its end effector some 20 deg off the vertical [rad, m]."""
    s = 0.5 + 0.5 * np.sin(0.3 * t)
    down = np.stack([1.2 + 0.5 * s, 1.0 + 0.1 * s, 3.0 + 0.1 * s, 0.4 + 0.3 * s], axis=-1)
    wrist = np.pi - down[:, 2] - np.radians(20.0) * np.cos(0.2 * t)
    return np.column_stack([down, wrist])


def sensor_on_vehicle(boom: Boom, q: Array) -> tuple[Array, Array]:
    """Position (n, 3) and turn R_body_11 (n, 3, 3) of the sensor, written out without the code
    under test."""
    tip = forward_kinematics(boom, q)
    turn = np.radians(2.0)  # heading -2 deg is anticlockwise
    R = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    return MOUNT + (tip.position + tip.rotation @ SENSOR) @ R.T, R @ tip.rotation


def write_field(
    folder: Path, drive: Drive, seconds: float = 20.0, *, utc: float = 1.7830e9, seed: int | None = None, late: float = 0.0
) -> dict[str, str]:
    """Write vehicle.csv, joints.csv, triggers.csv and rig.toml; return their names.

    With a seed, the vehicle's log has the noise that its columns of deviations say; `late` is how
    late its stamps are.
    """
    t = np.arange(0.0, seconds, 0.05)
    random, noise = np.random.default_rng(seed), 0.0 if seed is None else 1.0
    place = drive.frame.enu(drive.point(t - late, ANTENNA)) + noise * random.normal(0.0, POSITION_STD, (len(t), 3))
    latitude, longitude, height = geodetic_of(drive.frame.ecef(place))
    # The inertial sensor is turned by 1.5 deg to the right of the vehicle.
    R_body_imu = attitude.rotation(0.0, 0.0, 0.0).T @ attitude.rotation(0.0, 0.0, np.radians(1.5))
    angles = np.degrees(attitude.angles(attitude.rotation(*drive.angles(t - late).T) @ R_body_imu))
    angles += noise * random.normal(0.0, [0.05, 0.05, 0.1], (len(t), 3))
    head = "utc,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,heading_deg,"
    head += "std_east_m,std_north_m,std_up_m,std_roll_deg,std_pitch_deg,std_heading_deg,quality"
    rows = [head]
    for k, at in enumerate(t):
        place = f"{np.degrees(latitude[k]):.11f},{np.degrees(longitude[k]):.11f},{height[k]:.5f}"
        rows.append(f"{utc + at:.3f},{place},{','.join(f'{a:.7f}' for a in angles[k])},0.014,0.014,0.02,0.05,0.05,0.1,4")
    (folder / "vehicle.csv").write_text("\n".join(rows) + "\n")
    t = np.arange(-0.5, seconds + 0.5, 0.01)
    lines = [f"{utc + at + 0.01:.3f},{','.join(f'{x:.8f}' for x in q)}" for at, q in zip(t, joint_position(t), strict=True)]
    (folder / "joints.csv").write_text("\n".join(["utc,q1,q2,q3,q4,q5", *lines]) + "\n")
    times = np.arange(0.1, seconds - 0.3, 0.25)
    (folder / "triggers.csv").write_text("\n".join(["utc,label", *(f"{utc + at:.3f},image-{k}" for k, at in enumerate(times))]))
    (folder / "rig.toml").write_text(RIG)
    return {name: str(folder / f"{name}.csv") for name in ("vehicle", "joints", "triggers")} | {"rig": str(folder / "rig.toml")}


def write_points(place: Path, drive: Drive, t: Array, r: Array, *, utc: float = 1.7830e9, seed: int = 0) -> None:
    """Write a total station's positions of a point at r (3,) or (n, 3) of the vehicle, each to 3
    mm."""
    noisy = drive.frame.enu(drive.point(t, r)) + np.random.default_rng(seed).normal(0.0, 0.003, (len(t), 3))
    latitude, longitude, height = geodetic_of(drive.frame.ecef(noisy))
    rows = zip(utc + t, np.degrees(latitude), np.degrees(longitude), height, strict=True)
    lines = [f"{at:.3f},{y:.11f},{x:.11f},{h:.5f},0.003,0.003,0.003" for at, y, x, h in rows]
    place.write_text("\n".join(["utc,latitude_deg,longitude_deg,height_m,std_east_m,std_north_m,std_up_m", *lines]) + "\n")


def true_spots(boom: Boom, drive: Drive, stamps: Array, q: Array) -> tuple[Array, Array]:
    """Where the sensor was (n, 3), and the canopy that it saw (n, 3), in east-north-up, by marching
    along the ray."""
    t = stamps - 0.02
    R = attitude.rotation(*drive.angles(t).T)
    at, turn = sensor_on_vehicle(boom, q)
    origin = drive.origin(t)
    sensor = origin + np.einsum("nij,nj->ni", R, at)
    plane = (origin + np.einsum("nij,j->ni", R, np.array([MOUNT[0], MOUNT[1], -0.4])))[:, 2] + 0.8
    ray = np.einsum("nij,nj->ni", R, turn[:, :, 0])
    low, high = np.zeros(len(t)), np.full(len(t), 20.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = sensor[:, 2] + middle * ray[:, 2] > plane
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return sensor, sensor + low[:, None] * ray


FRAME = SASKATOON
