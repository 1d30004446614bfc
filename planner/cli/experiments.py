"""From measurements of the machine to its model."""

from typing import TYPE_CHECKING, Any

import click

from boom_model import Boom, InputError
from boom_model.boom import in_degrees
from boom_model.plausible import POSITION, TIP_ERROR
from boom_model.words import numbers
from planner.cli.completion import OneOf, OutFile
from planner.cli.options import (
    all_option,
    boom_option,
    given_catalogue,
    json_option,
    load_boom,
    outputs,
    payload_option,
    plausible,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows

if TYPE_CHECKING:
    from planner.experiments.calibration import Calibrated, Check
    from planner.experiments.calibration_poses import SuggestedPoses

_FEW_POSES = 8


@click.command()
@click.argument("measured", type=click.Path(), metavar="[MEASURED.csv]", required=False)
@click.option("--sd", type=float, callback=plausible(TIP_ERROR), metavar="M",
              help="Standard deviation of a coordinate, where the file has no sx, sy, sz; else estimated.")  # fmt: skip
@click.option("--frame", type=OneOf(["own", "boom"]), metavar="own|boom", default="own", show_default=True,
              help="Frame of the tips: the instrument's own, whose place is fitted, or frame 1 of the boom.")  # fmt: skip
@click.option("--linkage", type=OneOf(["auto", "equal", "unequal"]), metavar="auto|equal|unequal", default="auto",
              show_default=True, help="Whether opposite links may differ; auto asks the data.")  # fmt: skip
@click.option("--target", metavar="X,Y,Z", default="0,0,0", show_default=True,
              help="The measured target from the tip, in frame 11 [m].")  # fmt: skip
@click.option("--hold", "held", multiple=True, metavar="FIGURE", help="Keep a figure as it is; may be given again.")
@click.option("--check", type=click.Path(), metavar="OTHER.csv", help="Poses not used in the fit, to test it on.")
@click.option("--tolerance", type=float, callback=plausible(TIP_ERROR), metavar="M",
              help="Largest tip error allowed, RMS, at poses not used.")  # fmt: skip
@click.option("--suggest", type=int, metavar="N", help="Choose N poses worth measuring, beside those measured.")
@click.option("--lowest", type=float, callback=plausible(POSITION), metavar="M", help="Least height of a suggested tip.")
@click.option("--out", type=OutFile(".toml", ".csv"), metavar="FILE",
              help="The calibrated boom (.toml); with --suggest the poses (.csv).")  # fmt: skip
@payload_option
@boom_option
@all_option
@json_option
def calibrate(measured: str | None, suggest: int | None, **given: Any) -> int:
    """Find the boom's true lengths and zeros from measured tips, or the poses worth measuring.

    MEASURED holds a row a pose: the readings q1..q5 [rad, q4 in m], the tip x, y, z [m] by tracker
    or total station (empty where not measured), or by tape its distance d from a fixed point ax,
    ay, az [m]; and where known the standard deviations sx, sy, sz, sd and sq1..sq5.

    \b
    Examples:
      boom calibrate --suggest 30 --out poses.csv
      boom calibrate measured.csv --sd 0.0005 --out mine.toml
    """
    if suggest is not None:
        return _suggest(measured, suggest, **given)
    if measured is None:
        raise InputError("nothing to calibrate from: give MEASURED.csv, or --suggest N for the poses to measure")
    return _calibrate(measured, **given)


def _calibrate(
    measured: str,
    *,
    sd: float | None,
    frame: str,
    linkage: Any,
    target: str,
    held: tuple[str, ...],
    check: str | None,
    tolerance: float | None,
    lowest: float | None,
    out: str | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    from planner.experiments import calibration, calibration_answer
    from planner.experiments.calibration_file import write_calibrated
    from planner.experiments.measurements import read_measurements

    if lowest is not None:
        raise InputError("--lowest bounds suggested poses; it needs --suggest N")
    _require_ending(out, ".toml", "the calibrated boom")
    files, boom = outputs(out, inputs=(measured, check, boom_file)), load_boom(boom_file, payload)
    found = calibration.calibrate(
        boom,
        read_measurements(measured, sd),
        known_frame=frame == "boom",
        linkage=linkage,
        target=numbers("--target", target, 3),
        held=held,
    )
    tested = None if check is None else found.checked_on(read_measurements(check, sd))
    if out is not None:
        with files:
            write_calibrated(found, files.temporary(out), boom_file, given_catalogue())
    written = {} if out is None else {"boom": out}
    if as_json:
        print_json(calibration_answer.to_json(found, tested, written))
    else:
        _print_calibration(found, tested, measured, written, whole)
    error = found.held_out_rms if tested is None else tested.after
    if tolerance is None or error <= tolerance:
        return 0
    complain(f"tip error {error * 1e3:.2f} mm of {tolerance * 1e3:g} mm allowed")
    return ANSWER_IS_NO


def _print_calibration(found: "Calibrated", check: "Check | None", measured: str, written: dict[str, str], whole: bool) -> None:
    from planner.experiments import calibration_answer as answer

    held = [p for p in found.parameters if p.sd is None]
    print_lines(None, [f"{measured}: {int(found.used.sum())} of {len(found.used)} poses used"])
    print_lines(None, answer.sentences(found, check))
    fitted = [p for p in found.parameters if p.sd is not None]
    print_rows(answer.HEADER, [answer.cells(p) for p in fitted if whole or p.name not in answer.DETAILS])
    if whole:
        print_rows(answer.HELD_HEADER, map(answer.held_cells, held))
        print_lines(None, [f"least singular value {found.singular_values[-1]:.3g} (1: as sure as before the measurement)"])
    else:
        print_lines("fitted too", [", ".join(p.name for p in fitted if p.name in answer.DETAILS) or "nothing"])
        print_lines("held as they were", [f"{', '.join(p.name for p in held) or 'none'} (--all says why)"])
    print_lines("note", [*(found.interval_notes if whole else ()), *found.notes])
    print_files(written)
    name = written.get("boom")
    print_lines("next", [f"boom info --boom {name}" if name else f"boom calibrate {measured} --out mine.toml"])


def _suggest(
    measured: str | None,
    count: int,
    *,
    sd: float | None,
    frame: str,
    lowest: float | None,
    out: str | None,
    payload: float | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
    **unused: Any,
) -> int:
    from planner.experiments.calibration import USUAL_SD
    from planner.experiments.calibration_poses import suggest_poses
    from planner.experiments.measurements import read_measurements, write_poses

    if unused["check"] is not None or unused["tolerance"] is not None:
        raise InputError("--suggest chooses poses; --check and --tolerance need a calibration without it")
    _require_ending(out, ".csv", "the suggested poses")
    files, boom = outputs(out, inputs=(measured, boom_file)), load_boom(boom_file, payload)
    known = None if measured is None else read_measurements(measured, sd).readings
    spread = USUAL_SD if sd is None else sd
    found = suggest_poses(boom, count, tip_sd=spread, known_frame=frame == "boom", lowest=lowest, measured=known)
    if out is not None:
        with files:
            write_poses(files.temporary(out), found.q)
    written = {} if out is None else {"poses": out}
    if as_json:
        sds = dict(zip(found.names, found.sd.tolist(), strict=True))
        print_json({"q": found.q.tolist(), "sd": sds, "gain": found.gain, "files": written})
    else:
        _print_poses(boom, found, spread, written, whole)
    return 0


def _print_poses(boom: Boom, found: "SuggestedPoses", spread: float, written: dict[str, str], whole: bool) -> None:
    from boom_model import JOINTS
    from planner.experiments.calibration_answer import unit_of

    print_lines(None, [f"{len(found.q)} poses for {boom.name}, tips measured to {spread * 1e3:g} mm"])
    print_lines(None, [f"each figure becomes {found.gain:.2f} times as sure as by as many random poses"])
    shown = found.q if whole else found.q[:_FEW_POSES]
    degrees = in_degrees(shown)
    rows = [(str(i + 1), *(f"{x:.3f}" if k == 3 else f"{x:.1f}" for k, x in enumerate(q))) for i, q in enumerate(degrees)]
    print_rows(("pose", *(f"{joint} {'m' if joint == 'extension' else 'deg'}" for joint in JOINTS)), rows)
    if len(shown) < len(found.q):
        print_lines(None, [f"{len(found.q) - len(shown)} more poses: --all, or --out poses.csv"])
    names = ("L9 - L4", "L5 - L3", "L4", "inner offset", "lower offset")
    expected = []
    for name, sd in zip(found.names, found.sd, strict=True):
        if name in names:
            unit, by = unit_of(name)
            expected.append(f"{name} {sd * by:.2g} {unit}")
    print_lines("expected standard deviation", [", ".join(expected)])
    print_files(written)
    name = written.get("poses", "poses.csv")
    print_lines("next", [f"measure x, y, z at each pose into {name}, then boom calibrate {name}"])


def _require_ending(out: str | None, ending: str, what: str) -> None:
    if out is not None and not out.endswith(ending):
        raise InputError(f"{out}: {what} {'are' if what.endswith('s') else 'is'} written as {ending}")
