"""Identification of the dynamics: fit to logs, payload alone, and the motion worth measuring."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from boom_model import JOINTS, Boom, InputError
from boom_model.boom import IS_LENGTH, in_degrees
from boom_model.plausible import Range
from planner.cli.completion import OneOf, OutFile, any_file
from planner.cli.options import all_option, boom_option, json_option, load_boom, outputs, payload_option, plausible
from planner.cli.printing import (
    ANSWER_IS_NO,
    complain,
    print_files,
    print_json,
    print_lines,
    print_report,
    print_rows,
    tracked,
)

if TYPE_CHECKING:
    from planner.experiments.readings import Readings
    from planner.files import Outputs

_CUTOFF = Range(0.05, 1e3, "Hz")
_PERIOD = Range(1.0, 600.0, "s")
_SURE = 1.96


@click.command()
@click.argument("logs", metavar="LOG...", shell_complete=any_file, nargs=-1)
@click.option("--design", is_flag=True, help="Write the motion worth measuring instead; takes a minute.")
@click.option("--payload-only", is_flag=True, help="Find the payload's mass and centre of mass alone, from a short move.")
@click.option(
    "--torque-per-ampere", metavar="K1,..,K5", help="tau1..tau5 are motor currents: motor constant times gear ratio, Nm/A, N/A."
)
@click.option("--drive-inertia", is_flag=True, help="The torques accelerate the drives' rotors too; currents always do.")
@click.option(
    "--cutoff",
    type=float,
    callback=plausible(_CUTOFF),
    metavar="HZ",
    help="Low-pass filter of the positions; else it is found.",
)
@click.option("--out", type=OutFile(".toml"), metavar="FILE.toml", help="The boom's file with what was measured.")
@click.option(
    "--criterion", type=OneOf(["condition", "information"]), metavar="condition|information", default="condition",
    show_default=True, help="What --design makes best.",
)  # fmt: skip
@click.option("--period", type=float, callback=plausible(_PERIOD), metavar="S", help="Period of --design; else 20 s.")
@click.option("--csv", "motion", type=OutFile(".csv"), metavar="FILE.csv", help="The motion of --design.")
@click.option("--record", type=OutFile(".rrd"), metavar="FILE.rrd", help="A recording of --design, for `boom view`.")
@payload_option
@boom_option
@all_option
@json_option
def identify(
    logs: tuple[str, ...],
    design: bool,
    payload_only: bool,
    torque_per_ampere: str | None,
    drive_inertia: bool,
    cutoff: float | None,
    out: str | None,
    criterion: Any,
    period: float | None,
    motion: str | None,
    record: str | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Identify masses, centres of mass, inertias and friction from measured motions and torques.

    LOG is a CSV or Parquet file: t, q1..q5, tau1..tau5 in SI. The last fifth of each is kept for
    validation. The payload must be known (--payload), unless --payload-only asks for it.

    \b
    Examples:
      boom identify --design --payload 0 --csv excite.csv
      boom identify log.csv --payload 0 --out measured.toml
      boom identify short.csv --payload-only --boom measured.toml
    """
    if design:
        if logs or payload_only or out is not None:
            raise InputError("--design takes no log, no --payload-only and no --out: it writes the motion to measure")
        boom = load_boom(boom_file, payload)
        return _design(boom, boom_file, criterion, period, motion, record, as_json, whole)
    if not logs:
        raise InputError("no log is given; boom identify LOG.csv, or boom identify --design for the motion to measure")
    if motion is not None or record is not None or period is not None:
        raise InputError("--csv, --record and --period belong to --design")
    files, boom = outputs(out, inputs=(*logs, boom_file)), load_boom(boom_file, payload)
    constants = None if torque_per_ampere is None else _five(torque_per_ampere)
    read = [_readings(boom, name, constants, cutoff) for name in logs]
    inertia = drive_inertia or constants is not None
    asked = _Asked(boom, read, inertia, files, out, boom_file, ", ".join(logs), as_json, whole)
    return _payload(asked) if payload_only else _dynamics(asked)


@dataclass(frozen=True)
class _Asked:
    """What a fit works on, and where its answer goes."""

    boom: Boom
    read: "list[Readings]"
    drive_inertia: bool
    files: "Outputs"
    out: str | None
    boom_file: str | None
    logs: str
    as_json: bool
    whole: bool

    def written(self, write: Callable[[str], None]) -> dict[str, str]:
        """Write the boom's file, if one is asked for, and return the files by kind."""
        if self.out is None:
            return {}
        with self.files:
            write(self.files.temporary(self.out))
        return {"boom": self.out}


def _five(text: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 5:
        raise InputError(f"torque-per-ampere {text!r} must be five numbers, as in 30,30,30,400,8")
    return values


def _readings(boom: Boom, name: str, constants: list[float] | None, cutoff: float | None) -> "Readings":
    from planner.experiments.readings import read_torque_log, readings_of

    log = read_torque_log(name, constants)
    try:
        return readings_of(log, cutoff)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _dynamics(asked: _Asked) -> int:
    from planner.experiments.identification import identify as identify_dynamics
    from planner.experiments.identification import to_json
    from planner.experiments.measured_boom import write_identified

    found = identify_dynamics(asked.boom, asked.read, drive_inertia=asked.drive_inertia)
    answer = to_json(found, asked.written(lambda place: write_identified(place, asked.boom_file, found, asked.logs)))
    if asked.as_json:
        print_json(answer)
    else:
        _print_dynamics(answer, asked.logs, asked.boom.payload.mass, asked.whole)
    worse = [joint["joint"] for joint in answer["joints"] if joint["after"] > max(joint["before"], 1.1 * joint["noise"])]
    if worse:
        complain(f"{', '.join(worse)}: the identified boom explains what was held out worse than the file; measure longer")
    return ANSWER_IS_NO if worse else 0


def _print_dynamics(answer: dict[str, Any], logs: str, payload: float, whole: bool) -> None:
    print_lines(None, [f"{logs}: {answer['duration_s']:.1f} s of motion and torques, payload {payload:g} kg"])
    told, total = answer["told"], answer["base_parameters"]
    print_lines(None, [f"it determines {told} of {total} combinations of masses and friction better than the boom's file"])
    rows = []
    for joint in answer["joints"]:
        parts = sorted(((size, name) for name, size in joint["parts"].items() if name != "residual"), reverse=True)
        main = ", ".join(f"{name} {size:.3g}" for size, name in parts[:2])
        figures = (f"{joint[key]:.3g}" for key in ("before", "after", "noise"))
        rows.append((f"{joint['joint']} [{joint['unit']}]", *figures, main))
    print_lines(None, ["Torque not explained, RMS over the last fifth, by the file and as identified"])
    print_rows(("joint", "file", "identified", "noise", "explained by"), rows)
    if whole:
        print_rows(("base parameter", "value", "+-", "file"), _cells(answer["base"] or []))
        print_rows(("parameter", "value", "+-", "file"), _cells(answer["parameters"]))
        print_lines("note", answer["notes"])
    else:
        print_lines("note", answer["warnings"])
        print_lines(None, [f"{len(answer['notes'])} notes, every parameter with its interval: --all lists them"])
    print_files(answer["files"])
    if "boom" in answer["files"]:
        print_lines("next", [f"boom compare LOG.csv --payload {payload:g} --after {answer['files']['boom']}"])


def _cells(parameters: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    return [
        (each["name"], f"{each['value']:.4g}", f"{_SURE * each['deviation']:.2g}", f"{each['start']:.4g}")
        for each in parameters
    ]


def _payload(asked: _Asked) -> int:
    from planner.experiments.measured_boom import write_payload
    from planner.experiments.payload import identify_payload

    found = identify_payload(asked.boom, asked.read, drive_inertia=asked.drive_inertia)
    why = f"boom identify --payload-only {asked.logs}: to {found.deviation:.2g} kg"
    answer = found.to_json(asked.written(lambda place: write_payload(place, asked.boom_file, found.boom, why)))
    if asked.as_json:
        print_json(answer)
        return 0
    low, high = answer["interval_kg"]
    print_lines(None, [f"{asked.logs}: {sum(log.t[-1] - log.t[0] for log in asked.read):.1f} s of motion and torques"])
    print_lines(None, [f"payload {answer['mass_kg']:.3f} kg, with 95 % between {low:.3f} and {high:.3f} kg"])
    com = ", ".join(
        f"{1e3 * x:.1f} +- {1e3 * _SURE * s:.1f}" for x, s in zip(found.boom.payload.com, found.com_deviation, strict=True)
    )
    print_lines(None, [f"centre of mass from the tip, in frame 11: {com} mm"])
    print_lines("note", [f"the move does not tell {axis}; it is held at the file's figure" for axis in found.held])
    print_rows(
        ("joint", "torque not explained", "noise"),
        [
            (f"{joint} [{'N' if IS_LENGTH[i] else 'Nm'}]", f"{found.residual[i]:.3g}", f"{found.noise[i]:.3g}")
            for i, joint in enumerate(JOINTS)
        ],
    )
    print_lines("note", ["the interval holds for a boom whose own figures are right: identify it first, without payload"])
    if asked.whole:
        print_lines("note", found.notes)
    print_files(answer["files"])
    return 0


def _design(
    boom: Boom,
    boom_file: str | None,
    criterion: Any,
    period: float | None,
    motion: str | None,
    record: str | None,
    as_json: bool,
    whole: bool,
) -> int:
    from planner.experiments.excitation import PERIOD, condition_number, design
    from planner.motion.motion_files import write_motion
    from planner.planning import check_motion

    files = outputs(motion, record, inputs=(boom_file,))
    found = design(boom, criterion=criterion, period=period or PERIOD, track=tracked("designing the motion"))
    move = check_motion(boom, found.trajectory, profile="excitation")
    written = {}
    with files:
        if motion is not None:
            write_motion(found.trajectory, files.temporary(motion), move.loads.tau)
            written["motion"] = motion
        if record is not None:
            from planner.recording import write_recording

            write_recording(files.temporary(record), move)
            written["recording"] = record
    states = found(np.linspace(0.0, found.period, 400, endpoint=False))
    asked = (
        f"excitation of {found.period:g} s, condition number {condition_number(boom, states):.0f}, "
        f"largest ratio to a limit {found.worst_ratio():.4f}; repeat it as often as you like"
    )
    then = f"plan to its start {_start(found.centre)}, run it, then boom identify LOG.csv"
    return print_report(move.report, asked, written, as_json, whole, then)


def _start(q: Any) -> str:
    return "q=" + ",".join(f"{x:.4g}" for x in in_degrees(q))
