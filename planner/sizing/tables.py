"""What the choice of drives came to, as tables for people."""

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

_SHAPED = {
    Adapt.NOTHING: "every drive is judged on the motion that the boom as it is, with its fitted drives, was planned to make; "
    "--adapt replan plans for each",
    Adapt.RESCALE: "every drive is judged on the motion that the boom as it is, with its fitted drives, was planned to make, "
    "slowed where it fails; --adapt replan plans for each",
    Adapt.REPLAN: "every drive is judged on a motion that was planned for it, the other joints' drives as they are fitted",
}
_LEVEL_GROUND = "level ground; --vehicle gives a slope, and shocks are checked move by move"
_STUCK = (
    "no motion was found with any drive; the other joints keep their fitted ones, and where one of those is what cannot, "
    "it has to be replaced first, in a boom file of your own"
)

SAVING = ("boom", "joint", "fitted", "lightest without a FAIL", "saves")


def ranking(choice: Choice) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows: a row a drive, best first. What all are warned of is not said of each."""
    timed = len({judged.duration for judged in choice.judged}) > 1
    header = ("", "drive", "supply", "mass", "least of the gearbox", "least of the motor", "warned of besides", "verdict")
    rows: list[tuple[str, ...]] = []
    for place, judged in enumerate(choice.judged, start=1):
        mass = "-" if judged.mass is None else f"{judged.mass:.1f} kg"
        parts = (Part.ACTUATOR, None) if isinstance(judged.drive, LinearDrive) else (Part.GEARBOX, Part.MOTOR)
        spare = ["-" if judged.fails or part is None else _margin(judged.tightest(part)) for part in parts]
        warned = ", ".join(check for check in judged.warned if check not in choice.warned) or "-"
        facts = ("-" if judged.fails else str(place), judged.name, judged.supply, mass, *spare, warned)
        cycle = "-" if judged.infeasible else f"{judged.moving:.1f} of {judged.duration:.0f} s"
        said = outcome(judged) if judged.infeasible is None else "FAIL: no motion"
        rows.append((*facts, *([cycle] if timed else []), said))
    return (*header[:-1], *(["moving"] if timed else []), header[-1]), rows


def no_motion(choice: Choice) -> tuple[str, ...]:
    """Why there is no motion with a drive, a sentence a reason: too long for a table."""
    drives: dict[str, list[str]] = {}
    for judged in choice.judged:
        if judged.infeasible is not None:
            drives.setdefault(judged.infeasible, []).append(f"{judged.name} ({judged.supply})")
    return tuple(f"{'; '.join(names)}: {reason}" for reason, names in drives.items())


def outcome(judged: Judged) -> str:
    """The verdict of a drive, or the first thing that fails; a check without data is no pass."""
    if judged.infeasible is not None:
        return f"FAIL: {judged.infeasible}"
    failing = judged.first_failing
    if failing is not None:
        _, check, demand, limit, *_ = cells(failing)
        return f"FAIL: {check}, {demand} of {limit}"
    return f"{Verdict.INCOMPLETE}: {len(judged.unknown)} without data" if judged.unknown else str(Verdict.PASS)


def motors(choices: Sequence[Choice]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows: each motor and gearbox, in its best supply, on each joint of each boom."""
    names = list(dict.fromkeys(judged.name for choice in choices for judged in choice.judged))
    rows: list[tuple[str, ...]] = []
    for choice in choices:
        best = {judged.name: judged for judged in reversed(choice.judged)}
        rows.append((choice.variant, choice.joint, *(_short(best.get(name)) for name in names)))
    return ("boom", "joint", *names), rows


def saving(choices: Sequence[Choice]) -> list[tuple[str, ...]]:
    """A row a joint of each boom under SAVING, and their sum where there is more than one joint."""
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


def unknown_checks(choices: Sequence[Choice]) -> tuple[str, ...]:
    """Checks that no drive's data allowed."""
    return tuple(dict.fromkeys(check for choice in choices for judged in choice.judged for check in judged.unknown))


def sizing_markdown(title: str, choices: Sequence[Choice], notes: Sequence[str], assumed: Sequence[str] = ()) -> str:
    """Everything as Markdown."""
    lines = [f"# {title}", "", "## What the lightest saves", "", *table(SAVING, saving(choices))]
    lines += ["", "## Each drive in its best supply", "", *table(*motors(choices))]
    for choice in (choice for choice in choices if choice.judged):
        lines += ["", f"## {choice.joint}, {choice.variant}", "", *table(*ranking(choice))]
        found = [f"- no motion with {sentence}" for sentence in no_motion(choice)]
        lines += ["", *found] if found else []
        lines += ["", f"All are warned of: {', '.join(choice.warned)}"] if choice.warned else []
    return "\n".join([*lines, *section("Notes", notes), *section("Assumed", assumed)]) + "\n"


def sizing_json(mission: str, choices: Sequence[Choice], notes: Sequence[str]) -> dict[str, Any]:
    """The JSON object of `boom size`, in SI."""
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
    """What a reader of the tables must know.

    Args:
        left_out: what was asked for and not tried, a sentence each.
    """
    absent = dict.fromkeys(choice.joint for choice in choices if choice.fitted is None and choice.judged)
    asked = (
        [f"{', '.join(absent)}: no drive is given, and the mass of one is not added to the model's bodies"] if absent else []
    )
    empty = dict.fromkeys(choice.joint for choice in choices if not choice.judged and not choice.unmet)
    asked += [f"{', '.join(empty)}: NOT CHECKED, the catalogue has nothing for it"] if empty else []
    none_left = dict.fromkeys(choice.joint for choice in choices if not choice.judged and choice.unmet)
    asked += [f"{', '.join(none_left)}: NOT CHECKED, nothing of the catalogue is left to try"] if none_left else []
    asked += dict.fromkeys(_cannot(choice) for choice in choices if choice.fitted is not None and choice.fitted.infeasible)
    stuck = dict.fromkeys(choice.joint for choice in choices if choice.judged and all(j.infeasible for j in choice.judged))
    asked += [f"{', '.join(stuck)}: {_STUCK}"] if stuck else []
    unknown = ", ".join(unknown_checks(choices))
    notes = [
        f"a margin is (limit - demand) / demand, and a motor's torque needs {STEPPER_MARGIN:.0%}; ranked by mass, then by the "
        "least margin beyond the required one",
        "power-off is the brake's matter and left out; see the mission's own report",
        _SHAPED[adapt],
        _LEVEL_GROUND if vehicle is LEVEL else vehicle.sentence,
        *sorted({_tolerance(judged) for choice in choices for judged in choice.judged} - {""}),
    ]
    notes += [f"no drive is known to pass, for want of data: {unknown}"] if unknown else []
    return (*notes, *left_out, *asked)


def _cannot(choice: Choice) -> str:
    why = None if choice.fitted is None else choice.fitted.infeasible
    return f"{choice.joint}, {choice.variant}: the fitted drives cannot do the mission: {why}"


def _tolerance(judged: Judged) -> str:
    if isinstance(judged.drive, LinearDrive) or judged.drive.motor.tolerance is None:
        return ""
    return (
        f"motors differ by up to {judged.drive.motor.tolerance:.0%} from their sheet, which their required margin has to bear"
    )


def _named(judged: Judged | None) -> str:
    if judged is None:
        return "none"
    mass = "" if judged.mass is None else f", {judged.mass:.1f} kg"
    return f"{judged.name} ({judged.supply}){mass}" + (", finds no motion" if judged.infeasible else "")


def _margin(row: Row | None) -> str:
    """A check and its margin, with the one required where there is one."""
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
