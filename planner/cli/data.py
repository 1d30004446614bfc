"""The commands that show the boom and the catalogue, and write a boom file to start from."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from importlib.resources import files as resources
from itertools import takewhile
from typing import Any, TypeVar

import click
import numpy as np

from boom_model import JOINTS, Boom, Catalogue, Gearbox, LinearActuator, Motor, forward_kinematics
from boom_model.boom import IS_LENGTH
from boom_model.measured import measured_lines
from boom_model.provenance import Basis, Origin
from planner.cli.completion import OutFile
from planner.cli.options import all_option, boom_option, given_catalogue, json_option, load_boom, outputs
from planner.cli.printing import print_files, print_json, print_lines, print_rows

_RANKS = ("position", "velocity", "acceleration", "jerk")


@click.command()
@boom_option
@json_option
def info(boom_file: str | None, as_json: bool) -> int:
    """Show the boom: joints with limits and drives, poses, and the basis of its figures.

    \b
    Example:
      boom info --boom mine.toml
    """
    boom = load_boom(boom_file)
    if as_json:
        print_json(_info(boom))
        return 0
    g = boom.geometry
    longest = g.L2 + g.L4 + g.L7 + float(boom.limits.upper[3]) + g.L8
    masses = f"payload {boom.payload.mass:g} kg, {_moving(boom):.2f} kg move"
    print_lines(None, [f"{boom.name}: reach up to {longest:.2f} m, {masses}"])
    rows = []
    for i, joint in enumerate(JOINTS):
        low, high, speed, push, jerk = (_shown(i, value) for value in _limits(boom, i))
        rows.append((joint, f"{low} to {high} {'m' if IS_LENGTH[i] else 'deg'}", speed, push, jerk, _drive(boom, joint)))
    print_rows(("joint", "range", "speed/s", "acc/s2", "jerk/s3", "drive"), rows, drop=("jerk/s3",))
    print_lines(None, [f"basis of speeds, accelerations and jerks: {', '.join(_bases(boom))}"])
    print_lines("measured", _measured(boom))
    print_lines(None, [f"lower - inner stays above {np.degrees(boom.limits.linkage):g} deg"])
    for name in sorted(boom.poses):
        tip = forward_kinematics(boom, boom.poses[name])
        x, y, z = tip.position
        print_lines(None, [f"pose {name}: {_pose(boom, name)}"])
        print_lines(None, [f"  tip at {x:.3f}, {y:.3f}, {z:.3f} m"])
    print_lines("next", ["boom fk phenotyping; boom new mine.toml"])
    return 0


@click.command()
@boom_option
@all_option
@json_option
def catalogue(boom_file: str | None, whole: bool, as_json: bool) -> int:
    """Show the motors, gearboxes and linear actuators of the catalogue, by series.

    --all lists each one with its datasheet figures and their source.

    \b
    Example:
      boom catalogue --catalogue mine.toml --all
    """
    known = Catalogue.load().with_file(given_catalogue())
    if as_json:
        kinds = {field.name: getattr(known, field.name) for field in fields(known)}
        print_json({kind: {name: _plain(entry) for name, entry in entries.items()} for kind, entries in kinds.items()})
        return 0
    for header, rows in (
        (("motor", "kind", "holding, rated", "running, peak", "mass"), _rows(known.motors, _motor_figures)),
        (("gearbox", "ratio", "rated", "average", "start, stop", "peak"), _rows(known.gearboxes, _gearbox_figures)),
        (("actuator", "rated", "peak", "speed", "lead"), _rows(known.actuators, _actuator_figures)),
    ):
        shown = {name: [row] for name, row in rows.items()} if whole else _series(rows)
        if shown:
            print_rows(header, [(name, *_spread(group)) for name, group in shown.items()])
    entries: list[Motor | Gearbox | LinearActuator] = [
        *known.motors.values(),
        *known.gearboxes.values(),
        *known.actuators.values(),
    ]
    sources: dict[str, list[str]] = {}
    for entry in entries:
        sources.setdefault(entry.source, []).append(entry.name)
    print_lines("source", (f"{', '.join(names)}: {text}" for text, names in sources.items()) if whole else ())
    print_lines(None, [] if whole else [f"{len(entries)} entries: --all lists each, with its source"])
    return 0


_Figure = tuple[float | None, str] | str
"""A number with its unit, or a word."""

_Row = tuple[_Figure, ...]
_Entry = TypeVar("_Entry")


def _rows(entries: Mapping[str, _Entry], figures: Callable[[_Entry], _Row]) -> dict[str, _Row]:
    return {name: figures(entry) for name, entry in entries.items()}


def _motor_figures(motor: Motor) -> _Row:
    most, lasting = (motor.rated_torque, motor.peak_torque) if motor.is_servo else (motor.holding_torque, motor.running_torque)
    kind = "servo" if motor.is_servo else "stepper"
    return kind, (most, "Nm"), (lasting, "Nm"), (motor.mass, "kg")


def _gearbox_figures(gear: Gearbox) -> _Row:
    torques = (gear.continuous_torque, gear.max_average_torque, gear.start_stop_torque, gear.peak_torque)
    return (gear.ratio, ""), *((torque, "Nm") for torque in torques)


def _actuator_figures(actuator: LinearActuator) -> _Row:
    speed, lead = (None if value is None else 1e3 * value for value in (actuator.max_speed, actuator.lead))
    return (actuator.rated_force, "N"), (actuator.peak_force, "N"), (speed, "mm/s"), (lead, "mm")


def _spread(rows: Sequence[_Row]) -> tuple[str, ...]:
    """Return the range of each figure of some rows, column by column, or its word."""
    return tuple(_range([row[column] for row in rows]) for column in range(len(rows[0])))


def _range(figures: Sequence[_Figure]) -> str:
    words = dict.fromkeys(figure for figure in figures if isinstance(figure, str))
    numbers = [figure for figure in figures if not isinstance(figure, str)]
    values = [value for value, _ in numbers if value is not None]
    if words or not values:
        return ", ".join(words) or "-"
    low, high = min(values), max(values)
    span = f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
    return f"{span} {numbers[0][1]}".rstrip()


def _series(rows: Mapping[str, _Row]) -> dict[str, list[_Row]]:
    """Return entries by series: the letters that their names begin with, and their number."""
    groups: dict[str, dict[str, _Row]] = {}
    for name, row in rows.items():
        letters = "".join(takewhile(str.isalpha, name)) or name
        groups.setdefault(letters, {})[name] = row
    return {
        next(iter(group)) if len(group) == 1 else f"{letters}... ({len(group)})": list(group.values())
        for letters, group in groups.items()
    }


@click.command()
@click.argument("out", metavar="FILE.toml", type=OutFile(".toml"))
def new(out: str) -> int:
    """Write the file of the third-generation boom, with units and sources, to start from.

    \b
    Example:
      boom new mine.toml
      boom plan transport phenotyping --boom mine.toml
    """
    files = outputs(out)
    text = (resources("boom_model") / "data" / "third_generation.toml").read_text(encoding="utf-8")
    with files, open(files.temporary(out), "w", encoding="utf-8") as file:
        file.write(text)
    print_files({"boom": out})
    print_lines("next", [f"change a figure, then boom info --boom {out}"])
    return 0


def _measured(boom: Boom) -> Iterable[str]:
    """Return what was measured on the machine."""
    g = boom.geometry
    yield from measured_lines(boom)
    if not g.is_parallelogram:
        yield f"unequal links: L5 - L3 {g.upper_less_lower * 1e3:+.2f} mm, L9 - L4 {g.inner_less_outer * 1e3:+.2f} mm"


def _limits(boom: Boom, joint: int) -> Iterable[float]:
    limits = boom.limits
    return (float(each[joint]) for each in (limits.lower, limits.upper, limits.velocity, limits.acceleration, limits.jerk))


def _shown(joint: int, value: float) -> str:
    return f"{value if IS_LENGTH[joint] else np.degrees(value):.6g}"


def _moving(boom: Boom) -> float:
    return sum(body.mass for name, body in boom.bodies.items() if name != "base") + boom.payload.mass


def _bases(boom: Boom) -> list[str]:
    counted = dict.fromkeys(Basis, 0)
    for rank in _RANKS[1:]:
        for origin in boom.limits.origins[rank]:
            counted[origin.basis] += 1
    return [f"{count} {basis}" for basis, count in counted.items() if count]


def _pose(boom: Boom, name: str) -> str:
    return ", ".join(f"{joint} {_shown(i, boom.poses[name][i])}" for i, joint in enumerate(JOINTS))


def _info(boom: Boom) -> dict[str, Any]:
    keys = ("lower", "upper", "velocity", "acceleration", "jerk")
    return {
        "name": boom.name,
        "payload_kg": boom.payload.mass,
        "moving_mass_kg": _moving(boom),
        "linkage_rad": boom.limits.linkage,
        "measured": list(measured_lines(boom)),
        "calibration": None if boom.calibration is None else _origin(boom.calibration.origin),
        "joints": [
            {
                "joint": joint,
                **dict(zip(keys, _limits(boom, i), strict=True)),
                "origins": {rank: _origin(boom.limits.origins[rank][i]) for rank in _RANKS},
                "drive": _drive(boom, joint),
            }
            for i, joint in enumerate(JOINTS)
        ],
        "poses": {name: q.tolist() for name, q in sorted(boom.poses.items())},
    }


def _origin(origin: Origin) -> dict[str, str]:
    return {"basis": str(origin.basis), "source": origin.source}


def _plain(entry: Any) -> dict[str, Any]:
    """Return the fields of an entry in SI, with windings as tables."""
    values = {field.name: getattr(entry, field.name) for field in fields(entry)}
    return {name: _plain(value) if hasattr(value, "__dataclass_fields__") else value for name, value in values.items()}


def _drive(boom: Boom, joint: str) -> str:
    drive = boom.drive_of(joint)
    return "none" if drive is None else drive.name
