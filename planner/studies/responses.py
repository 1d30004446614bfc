"""Responses of a sample: the columns of the dataset that the mission's checks give."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from boom_model import Boom
from boom_model.drives.linear_actuator import LinearDrive
from planner.checks.kinds import CheckKind, Part
from planner.checks.rows import Row, Verdict, overall
from planner.missions.mission import Cycle
from planner.reports.answer import usage

Columns = Iterator[tuple[str, Any]]

UNITS = {
    "duration_s": "s",
    "moving_s": "s",
    "tip_error_m": "m",
    "bodies_kg": "kg",
    "drives_kg": "kg",
    "mass_kg": "kg",
    "link_kg": "kg",
    "used": "",
}
"""Numeric responses of every study, with their units; the rows' own columns come beside them."""


def responses(boom: Boom, cycle: Cycle, rows: Sequence[Row], joints: Sequence[str]) -> dict[str, Any]:
    """Return the columns of a sample.

    Args:
        boom: the sample's boom.
        cycle: the mission as planned for it.
        rows: all checks of the cycle.
        joints: joints whose rows decide `verdict`, `used`, `tightest` and `failing`; () is all.
    """
    found: dict[str, Any] = {}
    for group in RESPONSES:
        found.update(group(boom, cycle, rows, joints))
    return found


def _decision(_: Boom, __: Cycle, rows: Sequence[Row], joints: Sequence[str]) -> Columns:
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


def _times(_: Boom, cycle: Cycle, __: Sequence[Row], ___: Sequence[str]) -> Columns:
    yield "duration_s", cycle.duty.duration
    yield (
        "moving_s",
        float(sum(n * leg.trajectory.duration for leg, n in zip(cycle.legs, cycle.counts, strict=True) if leg.moves)),
    )


def _masses(boom: Boom, _: Cycle, __: Sequence[Row], ___: Sequence[str]) -> Columns:
    """Yield the masses of bodies and drives; a boom's file does not say whether its bodies include their drives."""
    drives = [mass for drive in (*boom.drives, boom.actuator) if drive is not None and (mass := _drive_mass(drive)) is not None]
    yield "bodies_kg", boom.mass
    yield "drives_kg", float(sum(drives))
    yield "mass_kg", boom.mass + float(sum(drives))


def _rows(_: Boom, __: Cycle, rows: Sequence[Row], ___: Sequence[str]) -> Columns:
    """Yield the tip's error, and for every row that has them its margin and the share of its limit that is used."""
    for row in rows:
        if row.kind is CheckKind.TIP_DEFLECTION:
            yield "tip_error_m", row.demand
        share = usage(row)
        if share is not None:
            yield f"used: {_name(row)}", share
        if row.margin is not None:
            yield f"margin: {_name(row)}", row.margin


RESPONSES: tuple[Callable[[Boom, Cycle, Sequence[Row], Sequence[str]], Columns], ...] = (_decision, _times, _masses, _rows)
"""Groups of columns. Another response is another function here."""


def _name(row: Row) -> str:
    return f"{row.joint} {row.check}"


def _drive_mass(drive: Any) -> float | None:
    if isinstance(drive, LinearDrive):
        return drive.actuator.mass
    motor, gear = drive.motor.mass, drive.gearbox.mass
    return None if motor is None or gear is None else motor + gear
