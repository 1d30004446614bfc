"""Motor and gearbox loads over time with ratings and margins; the tip deflection."""

from collections.abc import Iterator

import numpy as np

from boom_model import JOINTS, Basis, Drive, tip_deflection
from boom_model.arrays import Array
from boom_model.drives.drive import available_torque, motor_torque
from boom_model.drives.gear_compliance import SURE
from planner.checks.kinds import CheckKind
from planner.planning import Move
from planner.recording.palette import (
    GREEN,
    LIMIT_COLOR,
    ORANGE,
    PAYLOAD_COLOR,
    PURPLE,
    SKY_BLUE,
    TOTAL_COLOR,
    YELLOW,
)
from planner.recording.plots import Bundle

MOST_MARGIN = 3.0
"""Margins are plotted up to this value; a margin is infinite where the demand is zero."""


def motor_bundles(move: Move) -> Iterator[Bundle]:
    """Yield the absolute torque of each motor together with its torque-speed limit."""
    motion = move.trajectory
    for i, (joint, drive) in enumerate(zip(JOINTS, move.boom.drives, strict=True)):
        if drive is None:
            continue
        torque = motor_torque(drive, move.loads.tau[:, i], motion.qd[:, i], motion.qdd[:, i])
        curve = available_torque(drive, drive.gearbox.ratio * motion.qd[:, i])
        if torque is not None and curve is not None:
            basis = _basis(drive)
            asked = drive.motor.torque_margin
            names = ["torque [Nm]", f"available ({basis}) [Nm]", f"with {asked:.0%} margin ({basis}) [Nm]"]
            values = np.stack([np.abs(torque), curve, curve / (1.0 + asked)], axis=-1)
            colors = [SKY_BLUE, PAYLOAD_COLOR, LIMIT_COLOR]
            yield Bundle(f"plots/motor/{joint}", f"{joint}, {drive.motor.name} [Nm]", names, colors, values)


def gearbox_bundles(move: Move) -> Iterator[Bundle]:
    """Yield the absolute torque of each gearbox with its ratings and the average of the cycle."""
    tau = np.abs(move.loads.tau)
    for i, (joint, drive) in enumerate(zip(JOINTS, move.boom.drives, strict=True)):
        if drive is None:
            continue
        gear = drive.gearbox
        ratings = {
            "rated": gear.continuous_torque,
            "largest average": gear.max_average_torque,
            "start-stop": gear.start_stop_torque,
        }
        known = {name: value for name, value in ratings.items() if value is not None}
        rows = (row for row in move.report.rows if row.joint == joint and row.kind is CheckKind.GEARBOX_AVERAGE)
        average = next((row.demand for row in rows), None)
        if average is not None:
            known["average of the cycle"] = average
        names = ["torque [Nm]", *(f"{name} [Nm]" for name in known)]
        values = np.stack([tau[:, i], *(np.full(len(tau), value) for value in known.values())], axis=-1)
        kinds = {"rated": PAYLOAD_COLOR, "largest average": ORANGE, "start-stop": LIMIT_COLOR, "average of the cycle": GREEN}
        colors = [SKY_BLUE, *(kinds[name] for name in known)]
        yield Bundle(f"plots/gearbox/{joint}", f"{joint}, {gear.name} [Nm]", names, colors, values)


def margin_bundles(move: Move) -> Iterator[Bundle]:
    """Yield the margins (limit - demand) / demand [%] over time, with the required margins.

    The margin is computed as in the checks. It is shown for the start-stop and the momentary peak
    torque of each gearbox, and for the torque-speed curve of each motor.
    """
    motion, tau = move.trajectory, np.abs(move.loads.tau)
    for i, (joint, drive) in enumerate(zip(JOINTS, move.boom.drives, strict=True)):
        if drive is None:
            continue
        gear, curves, required = drive.gearbox, {}, {"gearbox, required": 0.0}
        for name, rating in (("start-stop", gear.start_stop_torque), ("momentary peak", gear.peak_torque)):
            if rating is not None:
                curves[f"gearbox, {name}"] = margin(tau[:, i], np.full(len(tau), rating))
        torque = motor_torque(drive, move.loads.tau[:, i], motion.qd[:, i], motion.qdd[:, i])
        curve = available_torque(drive, gear.ratio * motion.qd[:, i])
        if torque is not None and curve is not None:
            curves[f"motor ({_basis(drive)})"] = margin(np.abs(torque), curve)
            required["motor, required"] = drive.motor.torque_margin
        shown = [*curves.values(), *(np.full(len(tau), value) for value in required.values())]
        names = [f"{name} [%]" for name in (*curves, *required)]
        kinds = {"gearbox, start-stop": SKY_BLUE, "gearbox, momentary peak": PURPLE}
        colors = [*(kinds.get(name, TOTAL_COLOR) for name in curves), *(LIMIT_COLOR, YELLOW)[: len(required)]]
        title = f"{joint}: (limit - demand) / demand, up to {MOST_MARGIN:.0%} [%]"
        if curves:
            yield Bundle(f"plots/margin/{joint}", title, names, colors, 100.0 * np.stack(shown, axis=-1))


def margin(demand: Array, limit: Array) -> Array:
    """Return (limit - demand) / demand (n,), limited to MOST_MARGIN."""
    spare = limit - demand
    least = np.maximum(demand, limit / (1.0 + MOST_MARGIN) + np.finfo(float).tiny)
    return np.minimum(spare / least, MOST_MARGIN)


def tip_bundle(move: Move) -> Bundle:
    """Return the error budget of the tip [mm]."""
    budget = tip_deflection(move.boom, move.trajectory.q, move.loads.tau)
    parts = {
        "wind-up": (np.linalg.norm(budget.wind_up, axis=-1), SKY_BLUE),
        "hysteresis": (budget.hysteresis, ORANGE),
        "backlash": (budget.backlash, GREEN),
        "step error": (budget.step, PURPLE),
    }
    title = "largest tip deflection caused by the drives [mm], no limit is given"
    if move.boom.calibration is not None:
        parts[f"geometry, {SURE:g} sd"] = SURE * budget.geometry, YELLOW
        title = "largest tip error by drives and measured geometry [mm], no limit is given"
    parts["total"] = budget.total, TOTAL_COLOR
    curves, colors = zip(*parts.values(), strict=True)
    names = [f"{name} [mm]" for name in parts]
    return Bundle("plots/tip/deflection", title, names, colors, np.stack(curves, axis=-1) * 1e3)


def _basis(drive: Drive) -> Basis:
    return Basis.weakest([Basis.ESTIMATED, *(origin.basis for origin in drive.supply_origins)])
