"""The commands that show the boom and the catalogue, and write a boom file to start from."""

from collections.abc import Iterable
from dataclasses import fields
from importlib.resources import files as resources
from typing import Any

import click
import numpy as np

from boom_model import JOINTS, Boom, Catalogue, Drive, forward_kinematics
from boom_model.boom import IS_LENGTH
from boom_model.measured import measured_lines
from boom_model.provenance import Basis, Origin
from planner.cli.completion import OutFile
from planner.cli.options import boom_option, given_catalogue, json_option, load_boom, outputs
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
        rows.append((joint, f"{low} to {high} {'m' if IS_LENGTH[i] else 'deg'}", speed, push, jerk, _drive(boom, i)))
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
@json_option
def catalogue(boom_file: str | None, as_json: bool) -> int:
    """Show the motors, gearboxes and linear actuators of the catalogue, with datasheet figures.

    \b
    Example:
      boom catalogue --catalogue mine.toml
    """
    known = Catalogue.load().with_file(given_catalogue())
    if as_json:
        kinds = {field.name: getattr(known, field.name) for field in fields(known)}
        print_json({kind: {name: _plain(entry) for name, entry in entries.items()} for kind, entries in kinds.items()})
        return 0
    motors = [
        (m.name, _with(m.holding_torque, "Nm"), _with(m.running_torque, "Nm"), _with(m.mass, "kg"), m.source)
        for m in known.motors.values()
    ]
    print_rows(("motor", "holding", "running", "mass", "source"), motors, drop=("source",))
    gears = [
        (
            g.name,
            f"{g.ratio:g}",
            _with(g.max_average_torque, "Nm"),
            _with(g.start_stop_torque, "Nm"),
            _with(g.peak_torque, "Nm"),
            g.source,
        )
        for g in known.gearboxes.values()
    ]
    print_rows(("gearbox", "ratio", "average", "start, stop", "peak", "source"), gears, drop=("source",))
    actuators = [
        (a.name, _with(a.rated_force, "N"), _with(a.peak_force, "N"), _with(a.max_speed, "m/s"), a.source)
        for a in known.actuators.values()
    ]
    if actuators:
        print_rows(("actuator", "rated", "peak", "speed", "source"), actuators, drop=("source",))
    else:
        click.echo("no linear actuator; --catalogue FILE.toml adds your own")
    return 0


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


def _drive(boom: Boom, joint: int) -> str:
    drive = boom.drives[joint]
    if isinstance(drive, Drive):
        return f"{drive.motor.name} + {drive.gearbox.name}"
    actuator = boom.actuator if IS_LENGTH[joint] else None
    return "none" if actuator is None else actuator.actuator.name


def _pose(boom: Boom, name: str) -> str:
    return ", ".join(f"{joint} {_shown(i, boom.poses[name][i])}" for i, joint in enumerate(JOINTS))


def _with(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.6g} {unit}"


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
                "drive": _drive(boom, i),
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
