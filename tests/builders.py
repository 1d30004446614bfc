"""Booms, moves, missions, drives and shapes that several test files need; nothing is planned before
it is asked for."""

import os
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from boom_model import Basis, Boom, Catalogue, LinearActuator, Origin, kinetic_energy, potential_energy
from boom_model.arrays import Array
from boom_model.keep_out import Box, Capsule, KeepOut
from planner import Move, Trajectory, plan
from planner.checks.drives.duty import Duty
from planner.checks.drives.joint_view import JointView
from planner.checks.rows import Row
from planner.control.plant import Plant, spring_energy
from planner.missions.mission import Cycle, load_mission, plan_cycle
from planner.motion.trajectory import STEP
from planner.paths.path import Path
from planner.reports.report import Report
from planner.timing.time_law import Motion
from planner.timing.timing import Timing, timed

ORIGIN = Origin(Basis.ASSUMED, "a test")

# Booms


def without_drives(boom: Boom) -> Boom:
    """The boom whose joints have no drive."""
    return replace(boom, drives=(None,) * 5)


def with_drives(boom: Boom, **changes: Any) -> Boom:
    """The boom with fields of both its drives changed."""
    return replace(boom, drives=tuple(drive and replace(drive, **changes) for drive in boom.drives))


def with_running_torque(boom: Boom, torque: float) -> Boom:
    """The boom with another running torque [Nm] of both its motors."""
    drives = (drive and replace(drive, motor=replace(drive.motor, running_torque=torque)) for drive in boom.drives)
    return replace(boom, drives=tuple(drives))


def with_shapes(
    *shapes: Box | Capsule, clearance: float = 0.05, link_radius: float = 0.06, payload_radius: float = 0.15
) -> Boom:
    """The shipped boom with shapes to keep away from; lengths in [m]."""
    return replace(Boom.load(), keep_out=KeepOut(shapes, clearance, link_radius, payload_radius, ORIGIN))


POST = Capsule("post", np.array([1.0, 1.0, -1.0]), np.array([1.0, 1.0, 0.6]), 0.1, ORIGIN)
ROUND_POST = np.array([np.radians(10), 0.5, 2.6, 0.3, 0.0]), np.array([np.radians(80), 0.5, 2.6, 0.3, 0.0])
"""Start and goal on either side of the post: the straight move between them runs into it."""

# Drives


def thesis_catalogue() -> Catalogue:
    """The thesis's four motors and its gearbox from the shipped catalogue: few enough to try."""
    shipped = Catalogue.load()
    motors = {name: motor for name, motor in shipped.motors.items() if name.startswith("MST")}
    return replace(shipped, motors=motors, gearboxes={"CBG320160": shipped.gearboxes["CBG320160"]}, actuators={})


# Moves and missions


@cache
def main_move(profile: str = "cubic", step: float = STEP) -> Move:
    """The shipped boom's move from transport to phenotyping, planned once for all tests that only
    look at it."""
    return plan(Boom.load(), "transport", "phenotyping", profile=profile, step=step)


@cache
def planned_mission(name: str) -> Cycle:
    """A shipped mission with the shipped boom, planned once for all tests that only look at it."""
    return plan_cycle(Boom.load(), load_mission(name))


def motion_along(boom: Boom, path: Path, timing: Timing) -> Motion:
    """The motion along a path on level ground, without the checks of a whole plan."""
    (motion,) = timed(boom, [path], timing, None)
    return motion


UNDERSIZED_MISSION = """
name = "quick"
basis = "assumed"
source = "this test"
start = "transport"

[[steps]]
to = "phenotyping"
profile = "time-optimal"
"""
"""A mission's file that the fitted drive of lower cannot do with 30 kg."""

STRONG_CATALOGUE = """
[motors.BIG]
source = "this test"
step_deg = 1.8
holding_torque_Nm = 40
running_torque_Nm = 32
mass_kg = 12
rotor_inertia_kg_cm2 = 12
parallel = { current_A = 20, resistance_ohm = 0.1, inductance_mH = 0.5 }

[gearboxes.HUGE]
source = "this test"
ratio = 160
continuous_torque_Nm = 1500
max_average_torque_Nm = 1700
start_stop_torque_Nm = 2000
peak_torque_Nm = 4000
efficiency_percent = 65
no_load_input_torque_Nm = 0.5
mass_kg = 20
input_inertia_kg_m2 = 200e-6
"""
"""A catalogue's file with a drive that can."""

# Drives and their rows

SCREW = LinearActuator(
    name="SCREW",
    source="this test",
    rated_force=500.0,
    peak_force=800.0,
    static_force=900.0,
    max_speed=0.35,
    stroke=1.0,
    lead=0.010,
    efficiency=0.8,
    backdrive_force=100.0,
    duty=0.25,
    mass=4.0,
)


def joint_view(
    tau: ArrayLike = 0.0,
    qd: ArrayLike = 0.0,
    qdd: ArrayLike = 0.0,
    inertia: float = 1.0,
    t: ArrayLike | None = None,
    duty: Duty | None = None,
    static: ArrayLike | None = None,
    coulomb: float = 0.0,
) -> JointView:
    """Joint 2 of a motion whose torque, speed and acceleration are given sample by sample, or
    constant."""
    t = np.array([0.0, 1.0]) if t is None else np.asarray(t, dtype=float)
    tau, qd, qdd = (np.broadcast_to(np.asarray(x, dtype=float), t.shape) for x in (tau, qd, qdd))
    rates = np.zeros((2, t.size, 5))
    rates[0, :, 1], rates[1, :, 1] = qd, qdd
    return JointView(
        joint="inner",
        is_length=False,
        trajectory=Trajectory.from_samples(t, np.zeros((t.size, 5)), *rates),
        duty=Duty.alone(t) if duty is None else duty,
        tau=tau,
        tau_without_shock=tau,
        friction=np.zeros(t.size),
        coulomb=coulomb,
        static=tau if static is None else np.broadcast_to(np.asarray(static, dtype=float), t.shape),
        inertia=np.array([inertia]),
        index=1,
        basis=Basis.PRINTED,
        steady=True,
    )


def row(rows: Iterable[Row], check: str, joint: str | None = None) -> Row:
    """The first row of a check, of any joint or of the one that is named."""
    return next(each for each in rows if each.check == check and joint in (None, each.joint))


def row_of(report: Report, joint: str, check: str) -> Row:
    """A joint's row of a check."""
    return row(report.rows, check, joint)


# Simulations and files


def plant_energy(plant: Plant, x: Array) -> Array:
    """Kinetic, potential and elastic energy [J] (...) at states x = (q, qd, theta, theta') (...,
    14) of an elastic boom."""
    elastic = list(plant.elastic)
    q, qd, theta, theta_d = x[..., :5], x[..., 5:10], x[..., 10:12], x[..., 12:]
    links = kinetic_energy(plant.boom, q, qd) + potential_energy(plant.boom, q)
    rotors = 0.5 * (plant.rotor[elastic] * theta_d**2).sum(axis=-1)
    return links + rotors + spring_energy(plant, q, theta - q[..., elastic])


def hidden(folder: FilePath) -> list[str]:
    """Names of the hidden files in a folder."""
    return [name for name in os.listdir(folder) if name.startswith(".")]
