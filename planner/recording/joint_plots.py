"""Joint positions, rates and torques with limits; torque parts; pin forces and mount loads."""

from collections.abc import Iterator, Sequence

import numpy as np

from boom_model import JOINTS, Basis, Boom, Breakdown, Loads
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS, Mount
from boom_model.drives.drive import drive_inertia, drive_torque_limit
from planner.checks.energy import JointPower
from planner.motion.trajectory import Trajectory
from planner.recording.palette import (
    COLORS,
    GREEN,
    GREY,
    JOINT_COLORS,
    LIMIT_COLOR,
    ORANGE,
    PART_COLORS,
    PURPLE,
    SKY_BLUE,
    TOTAL_COLOR,
    YELLOW,
)
from planner.recording.plots import Bundle, Plot, for_people

MOST_RATIO = 5.0
"""Torque ratios are plotted up to this value.

The ratio of a motor too fast to give any torque is infinite.
"""


def position_plots(boom: Boom, trajectory: Trajectory) -> list[Plot]:
    """Return the joint positions, and the angle between the driven links."""
    limits = boom.limits
    linkage = Plot(
        "plots/q/linkage",
        "lower - inner",
        "deg",
        COLORS["upper"],
        np.degrees(trajectory.q[:, 2] - trajectory.q[:, 1]),
        {"minimum": float(np.degrees(limits.linkage))},
        limits.origins["linkage"][0].basis,
    )
    return [*_joint_plots(boom, "q", "position", "", trajectory.q, limits.lower, limits.upper), linkage]


def velocity_plots(boom: Boom, trajectory: Trajectory) -> list[Plot]:
    """Return the joint velocities."""
    most = boom.limits.velocity
    return list(_joint_plots(boom, "qd", "velocity", "/s", trajectory.qd, -most, most))


def acceleration_plots(boom: Boom, trajectory: Trajectory) -> list[Plot]:
    """Return the joint accelerations."""
    most = boom.limits.acceleration
    return list(_joint_plots(boom, "qdd", "acceleration", "/s^2", trajectory.qdd, -most, most))


def _joint_plots(boom: Boom, quantity: str, name: str, per: str, values: Array, lower: Array, upper: Array) -> Iterator[Plot]:
    """Yield a plot per joint of q, qd or qdd: values (n, 5) between lower and upper (5,), in SI."""
    for i, joint in enumerate(JOINTS):
        low, high = for_people(i, np.array([lower[i], upper[i]]))
        yield Plot(
            f"plots/{quantity}/{joint}",
            f"{joint} {name}",
            f"{'m' if IS_LENGTH[i] else 'deg'}{per}",
            JOINT_COLORS[joint],
            for_people(i, values[:, i]),
            {"minimum": float(low), "maximum": float(high)},
            boom.limits.origins[name][i].basis,
        )


def torque_plots(boom: Boom, trajectory: Trajectory, tau: Array) -> Iterator[Plot]:
    """Yield the joint torques with the limits of their drives, sample by sample.

    The limits are -T - J qdd and T - J qdd. T(qd) is the torque that the drive allows at the speed
    of the joint. J is the drive's own inertia, which the drive accelerates too. A torque between
    its limits respects `drive_torque_limit`.
    """
    for i, (joint, drive) in enumerate(zip(JOINTS, boom.drives, strict=True)):
        limit = None if drive is None else drive_torque_limit(drive, trajectory.qd[:, i])
        limits: dict[str, float | Array] = {}
        if drive is not None and limit is not None:
            own = drive_inertia(drive) * trajectory.qdd[:, i]
            limits = {"drive minimum": -limit - own, "drive maximum": limit - own}
        basis = Basis.weakest([Basis.ESTIMATED, *([] if drive is None else [o.basis for o in drive.supply_origins])])
        name = "force" if IS_LENGTH[i] else "torque"
        why = "" if limits else "no drive limits it"
        unit, color = LOAD_UNITS[i], JOINT_COLORS[joint]
        yield Plot(f"plots/tau/{joint}", f"{joint} {name}", unit, color, tau[:, i], limits, basis, why)


def ratio_bundles(ratios: dict[str, Array]) -> list[Bundle]:
    """Return torque / limit of every driven joint, in one view with a line at 1.

    The list is empty where no drive limit is known.
    """
    if not ratios:
        return []
    values = [*(np.minimum(ratio, MOST_RATIO) for ratio in ratios.values())]
    values.append(np.ones_like(values[0]))
    colors = [*(JOINT_COLORS[joint] for joint in ratios), LIMIT_COLOR]
    title = f"torque / limit, up to {MOST_RATIO:g} [-]"
    return [Bundle("plots/ratio", title, [*ratios, "limit"], colors, np.stack(values, axis=-1))]


def part_bundles(parts: Breakdown) -> Iterator[Bundle]:
    """Yield the parts of each joint torque, which add up to it."""
    names, each, total = [*PART_COLORS, "total"], [getattr(parts, name) for name in PART_COLORS], parts.total
    for i, joint in enumerate(JOINTS):
        unit = LOAD_UNITS[i]
        values = np.stack([part[:, i] for part in (*each, total)], axis=-1)
        yield Bundle(f"plots/parts/{joint}", f"{joint} [{unit}]", names, [*PART_COLORS.values(), TOTAL_COLOR], values)


def power_bundles(powers: Sequence[JointPower]) -> Iterator[Bundle]:
    """Yield the power of each joint: at the joint, and of a known drive its losses and input."""
    for power in powers:
        known = {
            "at the joint": (power.output, SKY_BLUE),
            "windings": (power.copper, ORANGE),
            "gear loss": (power.gear_loss, PURPLE),
            "electrical": (power.electrical, GREEN),
        }
        series = {name: (values, color) for name, (values, color) in known.items() if values is not None}
        title = f"{power.joint} power [W]" + ("" if power.electrical is not None else ", no drive is given")
        names = [*series]
        colors, values = [color for _, color in series.values()], [values for values, _ in series.values()]
        yield Bundle(f"plots/power/{power.joint}", title, names, colors, np.stack(values, axis=-1))


def load_bundles(mount: Mount, loads: Loads) -> Iterator[Bundle]:
    """Yield the force and the moment on the mount, and the magnitudes of the pin forces."""
    if loads.mount is None or loads.pins is None:
        return
    for kind, unit, columns, limit in (("force", "N", slice(0, 3), mount.force), ("moment", "Nm", slice(3, 6), mount.moment)):
        vectors = loads.mount[:, columns]
        names, colors = ["x", "y", "z", "magnitude"], [SKY_BLUE, ORANGE, PURPLE, GREY]
        series = [*vectors.T, np.linalg.norm(vectors, axis=-1)]
        if limit is not None:
            names.append("limit" if limit.origin.basis is Basis.PRINTED else f"limit ({limit.origin.basis})")
            colors.append(LIMIT_COLOR)
            series.append(np.full(len(vectors), limit.value))
        title = f"{kind} on the mount [{unit}]" + ("" if limit is not None else ", no limit is given")
        yield Bundle(f"plots/mount/{kind}", title, [f"{n} [{unit}]" for n in names], colors, np.stack(series, axis=-1))
    pins = {6: loads.pins.frame_6, 7: loads.pins.frame_7, 8: loads.pins.frame_8}
    sizes = np.stack([np.linalg.norm(force, axis=-1) for force in pins.values()], axis=-1)
    names = [f"pin {pin} [N]" for pin in pins]
    yield Bundle("plots/pins", "magnitude of the pin forces [N], no limit is given", names, [YELLOW, GREEN, SKY_BLUE], sizes)
