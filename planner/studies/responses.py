"""Responses of a sample: the columns of the dataset that the mission's checks give."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from boom_model import Boom, InputError
from boom_model.drives.linear_actuator import LinearDrive
from boom_model.words import nearest_name
from planner.checks.energy import Energy
from planner.checks.evaluation import Evaluation
from planner.checks.kinds import CheckKind, Part
from planner.checks.rows import Row, Verdict, overall
from planner.missions.mission import Cycle, cycle_energy
from planner.reports.answer import usage

Columns = Iterator[tuple[str, Any]]

LABELS = {
    "duration_s": ("duration [s]", 1.0),
    "moving_s": ("time in motion [s]", 1.0),
    "tip_error_m": ("tip error [mm]", 1e-3),
    "bodies_kg": ("mass of the bodies [kg]", 1.0),
    "drives_kg": ("mass of the drives [kg]", 1.0),
    "mass_kg": ("mass [kg]", 1.0),
    "link_kg": ("mass of the link [kg]", 1.0),
    "energy_J": ("energy [Wh]", 3600.0),
    "lost_J": ("energy lost [Wh]", 3600.0),
    "peak_W": ("peak power [W]", 1.0),
}
"""What people read in place of a column's name, and the size of its unit in SI."""


def label(name: str) -> tuple[str, float]:
    """Return what people read in place of a column's name, and the size of its unit in SI."""
    return LABELS.get(name, (name, 1.0))


def unknown_response(name: str, known: Iterable[str]) -> InputError:
    """Return the error of a response that no sample has; it suggests the nearest known one."""
    meant = nearest_name(name, known)
    hint = "every column of the dataset that holds numbers is one" if meant is None else f"did you mean {meant}?"
    return InputError(f"unknown response {name!r}; {hint}")


def responses(evaluation: Evaluation, cycle: Cycle, rows: Sequence[Row], joints: Sequence[str]) -> dict[str, Any]:
    """Return the columns of a sample.

    Args:
        evaluation: the sample's boom on the mission's cycle.
        cycle: the mission as planned for it.
        rows: all checks of the cycle.
        joints: joints whose rows decide `verdict`, `used`, `tightest` and `failing`; () is all.
    """
    found: dict[str, Any] = {}
    for group in (
        _decision(rows, joints),
        _times(cycle),
        _masses(evaluation.boom),
        _energies(cycle_energy(cycle, evaluation)),
        _rows(rows),
    ):
        found.update(group)
    return found


def _decision(rows: Sequence[Row], joints: Sequence[str]) -> Columns:
    """Yield the verdict, which rows fail, and the largest share that is used of a limit.

    A joint's speed and acceleration limits are left out of that share: the plan keeps them by
    itself.
    """
    deciding = [row for row in rows if not joints or row.joint in joints]
    loads = (row for row in deciding if row.kind.part is not Part.JOINT)
    shares = [(share, _name(row)) for row in loads if (share := usage(row)) is not None]
    used, tightest = max(shares, default=(None, None))
    yield "verdict", str(overall(deciding))
    yield "used", used
    yield "tightest", tightest
    yield "failing", ", ".join(_name(row) for row in deciding if row.verdict is Verdict.FAIL)


def _times(cycle: Cycle) -> Columns:
    yield "duration_s", cycle.duty.duration
    yield (
        "moving_s",
        float(sum(n * leg.trajectory.duration for leg, n in zip(cycle.legs, cycle.counts, strict=True) if leg.moves)),
    )


def _masses(boom: Boom) -> Columns:
    """Yield the masses of bodies and drives.

    A boom's file does not say whether its bodies include their drives.
    """
    drives = [mass for drive in (*boom.drives, boom.actuator) if drive is not None and (mass := _drive_mass(drive)) is not None]
    yield "bodies_kg", boom.mass
    yield "drives_kg", float(sum(drives))
    yield "mass_kg", boom.mass + float(sum(drives))


def _energies(energy: Energy) -> Columns:
    """Yield what a cycle takes from the supply, what of it is lost, and the peak power.

        lost = energy - (driving - braking - friction)

    of the joints whose drive has data. What is not lost moves the bodies. A loss is in the
    windings, drivers, gears, joints and brake resistor. None where no drive has data.
    """
    known = [joint for joint in energy.joints if joint.electrical is not None]
    kept = sum(joint.driving - joint.braking - joint.friction for joint in known)
    yield "energy_J", energy.drawn
    yield "lost_J", None if energy.drawn is None else energy.drawn - kept
    yield "peak_W", energy.peak_W


def _rows(rows: Sequence[Row]) -> Columns:
    """Yield the tip's error, and the margin and the used share of the limit of every row.

    What a row does not have is left out.
    """
    for row in rows:
        if row.kind is CheckKind.TIP_DEFLECTION:
            yield "tip_error_m", row.demand
        share = usage(row)
        if share is not None:
            yield f"used: {_name(row)}", share
        if row.margin is not None:
            yield f"margin: {_name(row)}", row.margin


def _name(row: Row) -> str:
    return f"{row.joint} {row.check}"


def _drive_mass(drive: Any) -> float | None:
    if isinstance(drive, LinearDrive):
        return drive.actuator.mass
    motor, gear = drive.motor.mass, drive.gearbox.mass
    return None if motor is None or gear is None else motor + gear
