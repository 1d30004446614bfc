"""Results of the choice of drives as tables."""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

from boom_model import LinearDrive
from boom_model.drives.drive import STEPPER_MARGIN
from planner.checks.kinds import Part
from planner.checks.rows import Row, Verdict
from planner.motion.vehicle import LEVEL, VehicleCase
from planner.reports.markdown import section, table
from planner.reports.report import cells
from planner.sizing.choice import Adapt, Choice, Judged

_ADAPT_NOTES = {
    Adapt.NOTHING: "every drive is checked on the motion planned for the boom with its fitted drives; "
    "--adapt replan plans a motion for each drive",
    Adapt.RESCALE: "every drive is checked on the motion planned for the boom with its fitted drives, slowed where the drive "
    "fails; --adapt replan plans a motion for each drive",
    Adapt.REPLAN: "every drive is checked on a motion planned for it; the other joints keep their fitted drives",
}
_LEVEL_GROUND = "the ground is level; --vehicle sets a slope; shocks are checked for single moves only"
_NO_DRIVE_WORKS = (
    "no motion was found with any drive; the other joints keep their fitted drives, and if one of those is the reason, "
    "replace it first in a boom file of your own"
)

SAVING = ("boom", "joint", "fitted", "best without a FAIL", "saved mass")


def ranking(choice: Choice) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows: one row per drive, best first.

    Warnings that every drive has are left out of the rows.
    """
    timed = len({judged.duration for judged in choice.judged}) > 1
    header = ("", "drive", "supply", "mass", "tightest gearbox check", "tightest motor check", "other warnings", "verdict")
    rows: list[tuple[str, ...]] = []
    for place, judged in enumerate(choice.judged, start=1):
        mass = "-" if judged.mass is None else f"{judged.mass:.1f} kg"
        parts = (Part.ACTUATOR, None) if isinstance(judged.drive, LinearDrive) else (Part.GEARBOX, Part.MOTOR)
        tightest = ["-" if judged.fails or part is None else _margin(judged.tightest(part)) for part in parts]
        warnings = ", ".join(check for check in judged.warned if check not in choice.warned) or "-"
        facts = ("-" if judged.fails else str(place), judged.name, judged.supply, mass, *tightest, warnings)
        cycle = "-" if judged.infeasible else f"{judged.moving:.1f} of {judged.duration:.0f} s"
        verdict = outcome(judged) if judged.infeasible is None else "FAIL: no motion"
        rows.append((*facts, *([cycle] if timed else []), verdict))
    return (*header[:-1], *(["moving"] if timed else []), header[-1]), rows


def no_motion(choice: Choice) -> tuple[str, ...]:
    """Return a sentence for each reason why drives have no motion.

    These sentences are too long for a table.
    """
    drives: dict[str, list[str]] = {}
    for judged in choice.judged:
        if judged.infeasible is not None:
            drives.setdefault(judged.infeasible, []).append(f"{judged.name} ({judged.supply})")
    return tuple(f"{'; '.join(names)}: {reason}" for reason, names in drives.items())


def outcome(judged: Judged) -> str:
    """Return the verdict of a drive, or its first failing check.

    A drive with a check without data is INCOMPLETE.
    """
    if judged.infeasible is not None:
        return f"FAIL: {judged.infeasible}"
    failing = judged.first_failing
    if failing is not None:
        _, check, demand, limit, *_ = cells(failing)
        return f"FAIL: {check}, {demand} of {limit}"
    return f"{Verdict.INCOMPLETE}: {len(judged.unknown)} without data" if judged.unknown else str(Verdict.PASS)


def motors(choices: Sequence[Choice]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows: one row per boom and joint, one column per motor and gearbox.

    Each motor is shown with its best supply.
    """
    names = list(dict.fromkeys(judged.name for choice in choices for judged in choice.judged))
    rows: list[tuple[str, ...]] = []
    for choice in choices:
        best = {judged.name: judged for judged in reversed(choice.judged)}
        rows.append((choice.variant, choice.joint, *(_short(best.get(name)) for name in names)))
    return ("boom", "joint", *names), rows


def saving(choices: Sequence[Choice]) -> list[tuple[str, ...]]:
    """Return one row under SAVING for each joint of each boom.

    A row with their sum follows if a boom has several joints.
    """
    rows: list[tuple[str, ...]] = []
    for variant, group in groupby(choices, key=lambda choice: choice.variant):
        parts = list(group)
        for choice in parts:
            saves = "-" if choice.saves is None else f"{choice.saves:.1f} kg"
            rows.append((variant, choice.joint, _named(choice.fitted), _named(choice.lightest), saves))
        known = [choice.saves for choice in parts if choice.saves is not None]
        if len(known) > 1:
            rows.append((variant, "together", "", "", f"{sum(known):.1f} kg"))
    return rows


ANSWER = ("boom", "joint", "fitted", "best that does not fail", "mass", "saves", "verdict")
"""Columns of `answer_rows`."""


def answer_rows(choices: Sequence[Choice]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of what to fit: a row per joint, and boom if there are several."""
    rows = []
    for choice in choices:
        best, fitted = choice.lightest, choice.fitted
        mass = "-" if best is None or best.mass is None else f"{best.mass:.1f} kg"
        saves = "-" if choice.saves is None else f"{choice.saves:.1f} kg"
        verdict = "none does" if choice.judged else "none to try"
        if best is not None:
            verdict = f"{len(best.unknown)} open" if best.unknown else "PASS"
        names = ("none" if each is None else each.name.replace(" + ", "+") for each in (fitted, best))
        rows.append((choice.variant, choice.joint, *names, mass, saves, verdict))
    several = len({row[0] for row in rows}) > 1
    return (ANSWER, rows) if several else (ANSWER[1:], [row[1:] for row in rows])


def conclusion(choices: Sequence[Choice]) -> tuple[str, ...]:
    """Return what the choice comes to, in a sentence for each boom."""
    sentences = []
    for variant, group in groupby(choices, key=lambda choice: choice.variant):
        parts = list(group)
        spared = [choice for choice in parts if choice.saves]
        none = [choice.joint for choice in parts if choice.lightest is None]
        said = []
        if spared:
            total = sum(choice.saves or 0.0 for choice in spared)
            said.append(f"{total:.1f} kg can be saved on {', '.join(choice.joint for choice in spared)}")
        elif any(choice.fitted is not None for choice in parts):
            said.append("no drive of a known mass that does is lighter")
        if none:
            said.append(f"the catalogue has no drive that does for {', '.join(none)}")
        sentences.append(f"{variant}: {'; '.join(said) or 'each joint has a drive that does'}")
    return tuple(sentences)


def unknown_checks(choices: Sequence[Choice]) -> tuple[str, ...]:
    """Return the checks for which no drive has data."""
    return tuple(dict.fromkeys(check for choice in choices for judged in choice.judged for check in judged.unknown))


def sizing_markdown(title: str, choices: Sequence[Choice], notes: Sequence[str], assumed: Sequence[str] = ()) -> str:
    """Return all tables and notes as Markdown."""
    lines = [f"# {title}", "", "## Mass saved by the lightest drive", "", *table(SAVING, saving(choices))]
    lines += ["", "## Each drive in its best supply", "", *table(*motors(choices))]
    for choice in (choice for choice in choices if choice.judged):
        lines += ["", f"## {choice.joint}, {choice.variant}", "", *table(*ranking(choice))]
        found = [f"- no motion with {sentence}" for sentence in no_motion(choice)]
        lines += ["", *found] if found else []
        lines += ["", f"Every drive has these warnings: {', '.join(choice.warned)}"] if choice.warned else []
    return "\n".join([*lines, *section("Notes", notes), *section("Assumed", assumed)]) + "\n"


def sizing_json(mission: str, choices: Sequence[Choice], notes: Sequence[str]) -> dict[str, Any]:
    """Return the JSON object of `boom size`, in SI."""
    return {
        "mission": mission,
        "choices": [
            {
                "variant": choice.variant,
                "joint": choice.joint,
                "fitted": None if choice.fitted is None else _judged_json(choice.fitted),
                "ranked": [_judged_json(judged) for judged in choice.judged],
                "saves_kg": choice.saves,
            }
            for choice in choices
        ],
        "notes": list(notes),
    }


def _judged_json(judged: Judged) -> dict[str, Any]:
    return {
        "drive": judged.name,
        "supply": judged.supply,
        "mass_kg": judged.mass,
        "verdict": judged.verdict,
        "cycle_s": None if judged.infeasible else judged.duration,
        "moving_s": None if judged.infeasible else judged.moving,
        "infeasible": judged.infeasible,
        "checks": [row.to_json() for row in judged.rows],
    }


def sizing_notes(
    choices: Sequence[Choice], adapt: Adapt = Adapt.NOTHING, vehicle: VehicleCase = LEVEL, left_out: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return the notes that explain the tables.

    Args:
        choices: the choices of the tables.
        adapt: what was adapted to a drive.
        vehicle: the slope that the boom stands on; None means level ground.
        left_out: a sentence for each requested combination that was not tried.
    """
    absent = dict.fromkeys(choice.joint for choice in choices if choice.fitted is None and choice.judged)
    by_joint = [f"{', '.join(absent)}: no drive is fitted; the mass of a new one is not added to any body"] if absent else []
    by_joint += [f"{joints}: NOT CHECKED, {reason}" for joints, reason in not_checked(choices)]
    by_joint += dict.fromkeys(
        _infeasible_note(choice) for choice in choices if choice.fitted is not None and choice.fitted.infeasible
    )
    no_drive = dict.fromkeys(choice.joint for choice in choices if choice.judged and all(j.infeasible for j in choice.judged))
    by_joint += [f"{', '.join(no_drive)}: {_NO_DRIVE_WORKS}"] if no_drive else []
    unknown = ", ".join(unknown_checks(choices))
    notes = [
        f"a margin is (limit - demand) / demand; motor torque needs a margin of {STEPPER_MARGIN:.0%}",
        "drives are ranked by the number of limits without data, then by mass, then by the smallest margin",
        "the power-off check is left out, because it depends on the brake; see the report of the mission",
        _ADAPT_NOTES[adapt],
        _LEVEL_GROUND if vehicle is LEVEL else vehicle.sentence,
        *sorted({_tolerance(judged) for choice in choices for judged in choice.judged} - {""}),
    ]
    notes += [f"no drive has the data for these checks, so none can PASS: {unknown}"] if unknown else []
    return (*notes, *left_out, *by_joint)


def not_checked(choices: Sequence[Choice]) -> list[tuple[str, str]]:
    """Return the joints for which no drive was tried, each time with the reason."""
    empty = dict.fromkeys(choice.joint for choice in choices if not choice.judged and not choice.unmet)
    none_left = dict.fromkeys(choice.joint for choice in choices if not choice.judged and choice.unmet)
    reasons = ((empty, "the catalogue has no drive for it"), (none_left, "no drive of the catalogue is left to try"))
    return [(", ".join(joints), reason) for joints, reason in reasons if joints]


def _infeasible_note(choice: Choice) -> str:
    why = None if choice.fitted is None else choice.fitted.infeasible
    return f"{choice.joint}, {choice.variant}: the fitted drives cannot do the mission: {why}"


def _tolerance(judged: Judged) -> str:
    if isinstance(judged.drive, LinearDrive) or judged.drive.motor.tolerance is None:
        return ""
    return f"a motor may differ by up to {judged.drive.motor.tolerance:.0%} from its datasheet; its margin must cover this"


def _named(judged: Judged | None) -> str:
    if judged is None:
        return "none"
    mass = "" if judged.mass is None else f", {judged.mass:.1f} kg"
    return f"{judged.name} ({judged.supply}){mass}" + (", no motion found" if judged.infeasible else "")


def _margin(row: Row | None) -> str:
    """Return a check with its margin, and with the required margin if the check fails."""
    if row is None:
        return "-"
    _, check, _, _, margin, required, *_ = cells(row)
    return f"{check} {margin}" + (f", {required} required" if row.required_margin and row.verdict is Verdict.FAIL else "")


def _short(judged: Judged | None) -> str:
    if judged is None:
        return "-"
    if not judged.fails:
        return f"no FAIL; {_margin(judged.tightest(Part.MOTOR) or judged.tightest())}"
    return "FAIL: no motion" if judged.first_failing is None else f"FAIL: {_margin(judged.first_failing)}"
