"""The command that compares a measured motion with its plan, and with two models of the machine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from boom_model import Boom, InputError
from boom_model.measured import measured_lines
from boom_model.plausible import TIME, TIP_ERROR, WINDOW
from planner.cli.completion import OutFile, any_file
from planner.cli.options import (
    all_option,
    boom_option,
    json_option,
    load_boom,
    outputs,
    payload_as_option,
    payload_option,
    plausible,
    report_option,
)
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows

if TYPE_CHECKING:
    from planner.experiments.comparison import Comparison, Log
    from planner.experiments.residuals import Residuals

_model = click.Path()


@click.command(context_settings={"ignore_unknown_options": True})  # so that --offset takes -0.5
@click.argument("motions", nargs=-1, metavar="[PLANNED] MEASURED", shell_complete=any_file)
@click.option(
    "--offset", default="0", show_default=True, metavar="S|best",
    help="Time added to the log. best fits it to the plan, which hides a delay of the drives.",
)  # fmt: skip
@click.option("--window", type=float, callback=plausible(WINDOW), metavar="S",
              help="Width of the filter that differentiates the log. Default: 0.2 s.")  # fmt: skip
@click.option("--tolerance", type=float, callback=plausible(TIP_ERROR), metavar="M", help="Largest allowed tip error.")
@click.option("--before", type=_model, metavar="FILE.toml", help="The boom as designed, where --boom is the measured one.")
@click.option("--after", type=_model, metavar="FILE.toml", help="The boom as measured, where --boom is the designed one.")
@click.option("--drive-inertia", is_flag=True, help="The torques of the log accelerate the drives' rotors too.")
@click.option("--out", type=OutFile(".rrd"), metavar="FILE.rrd", help="Write a recording for `boom view`.")
@report_option
@payload_option
@payload_as_option
@boom_option
@all_option
@json_option
def compare(motions: tuple[str, ...], document: str | None, **given: Any) -> int:
    """Compare a measured motion with its plan, and its torques with the model before and after.

    PLANNED and MEASURED are CSV or Parquet files. MEASURED has the columns t and q1..q5 in SI, and
    optionally qd1..qd5, qdd1..qdd5 and tau1..tau5. Missing derivatives come from a filter. With
    --before or --after, two models are compared by the torques that they leave unexplained;
    PLANNED may then be left out.

    \b
    Examples:
      boom compare move.csv log.csv --offset best --out both.rrd
      boom compare log.csv --boom measured.toml --before cad.toml --report better.pdf
    """
    asked = _asked(motions, document=document, **given)
    files = outputs(asked.out, document=document, inputs=(*motions, asked.boom_file, asked.before, asked.after))
    plan, models = _against_plan(asked), _models(asked)
    written = {kind: name for kind, name in (("recording", asked.out), ("report", document)) if name is not None}
    with files:
        if asked.out is not None:
            _record(files.temporary(asked.out), asked, plan, models)
        if document is not None:
            _report(files.temporary(document), asked, models)
    answer = _answer(asked, plan, models, written)
    if asked.as_json:
        print_json(answer)
    else:
        _print(asked, answer)
    return _conclude(answer)


@dataclass(frozen=True)
class _Asked:
    """What is compared with what."""

    planned: str | None
    measured: str
    offset: float | None
    window: float | None
    tolerance: float | None
    before: str | None
    after: str | None
    drive_inertia: bool
    out: str | None
    document: str | None
    payload: float | None
    payload_as: Any
    boom_file: str | None
    whole: bool
    as_json: bool

    @property
    def two_models(self) -> bool:
        """Whether there is a model before and one after."""
        return self.before is not None or self.after is not None

    @property
    def names(self) -> tuple[str, str]:
        """Files of the models before and after."""
        boom = "the shipped boom" if self.boom_file is None else self.boom_file
        return (self.before, boom) if self.before is not None else (boom, str(self.after))


def _asked(motions: tuple[str, ...], *, offset: str, **given: Any) -> _Asked:
    if not 1 <= len(motions) <= 2:
        raise InputError(f"{len(motions)} motions are given; boom compare takes PLANNED and MEASURED, or MEASURED alone")
    try:
        shift = None if offset == "best" else float(offset)
    except ValueError:
        raise InputError(f"offset {offset!r} is neither a number of seconds nor best") from None
    if shift is not None:
        TIME.require("offset", shift)
    planned = motions[0] if len(motions) == 2 else None
    asked = _Asked(planned, motions[-1], shift, **given)
    if asked.before is not None and asked.after is not None:
        raise InputError("--before and --after are both given; the other model is --boom: give one of them")
    if planned is None and not asked.two_models:
        raise InputError(f"nothing to compare {motions[0]} with: give PLANNED before it, or --before FILE.toml")
    if planned is None and (shift != 0.0 or asked.tolerance is not None or asked.window is not None):
        raise InputError("--offset, --window and --tolerance compare with a plan: give PLANNED before MEASURED")
    if asked.document is not None and not asked.two_models:
        raise InputError("--report is of two models: give the other one by --before FILE.toml or --after FILE.toml")
    return asked


def _log(asked: _Asked) -> "Log":
    from planner.experiments.comparison import read_log

    return read_log(asked.measured)


def _against_plan(asked: _Asked) -> "Comparison | None":
    from planner.experiments.comparison import WINDOW as USUAL_WINDOW
    from planner.experiments.comparison import compare as compare_motions
    from planner.motion.motion_files import read_motion

    if asked.planned is None:
        return None
    return compare_motions(
        load_boom(asked.boom_file, asked.payload),
        read_motion(asked.planned),
        _log(asked),
        offset=asked.offset,
        window=USUAL_WINDOW if asked.window is None else asked.window,
        payload_as=asked.payload_as,
    )


def _models(asked: _Asked) -> "Residuals | None":
    from planner.experiments.residuals import residuals

    if not asked.two_models:
        return None
    boom = load_boom(asked.boom_file, asked.payload)
    other = load_boom(asked.before if asked.before is not None else asked.after, asked.payload)
    before, after = (other, boom) if asked.before is not None else (boom, other)
    try:
        return residuals(before, after, _log(asked), drive_inertia=asked.drive_inertia, payload_as=asked.payload_as)
    except InputError as error:
        raise InputError(f"{asked.measured}: {error}") from None


def _record(place: str, asked: _Asked, plan: "Comparison | None", models: "Residuals | None") -> None:
    from planner.recording import write_before_after_recording, write_comparison_recording

    if plan is not None:
        write_comparison_recording(place, plan, models)
    elif models is not None:
        page, answer = _first_page(asked, models), models.to_json()
        from planner.experiments.residual_report import details

        write_before_after_recording(place, models, f"{page}\n{details(answer, measured_lines(models.after.boom))}")


def _first_page(asked: _Asked, models: "Residuals") -> str:
    from planner.experiments.residual_report import first_page

    before, after = asked.names
    title = f"{asked.measured}: before {before}, after {after}"
    return first_page(title, _span(asked, models.to_json(), models.after.boom), models.to_json())


def _span(asked: _Asked, answer: dict[str, Any], boom: Boom) -> str:
    return (
        f"{asked.measured}: {answer['samples']} samples from {answer['from_s']:.3f} to {answer['to_s']:.3f} s, "
        f"payload {boom.payload.mass:g} kg"
    )


def _report(place: str, asked: _Asked, models: "Residuals | None") -> None:
    from planner.experiments.residual_report import details, part_figure, residual_figure
    from planner.reports.document import write_document

    assert models is not None
    text = details(models.to_json(), measured_lines(models.after.boom))
    first = _first_page(asked, models), residual_figure(models)
    write_document(place, text, {"What takes the residual away": part_figure(models)}, first)


def _answer(asked: _Asked, plan: "Comparison | None", models: "Residuals | None", written: dict[str, str]) -> dict[str, Any]:
    if plan is None:
        answer: dict[str, Any] = {"files": written}
    else:
        answer = plan.to_json(written)
        peak, allowed = answer["tip"]["peak_m"], asked.tolerance
        verdict = None if allowed is None else "FAIL" if peak > allowed else "PASS"
        answer |= {"tolerance_m": allowed, "verdict": verdict}
    if models is not None:
        named = dict(zip(("before", "after"), asked.names, strict=True))
        measured = list(measured_lines(models.after.boom))
        answer["before_after"] = named | models.to_json() | {"payload_kg": models.after.boom.payload.mass, "measured": measured}
    return answer


def _conclude(answer: dict[str, Any]) -> int:
    """Complain of what is not as it should be, and return the exit code."""
    wrong = []
    if answer.get("verdict") == "FAIL":
        wrong.append(_tolerance_words(answer))
    worse = answer.get("before_after", {}).get("worse", ())
    if worse:
        wrong.append(f"{', '.join(worse)}: the model after explains the torques worse than the one before")
    if wrong:
        complain("; ".join(wrong))
    return ANSWER_IS_NO if wrong else 0


def _tolerance_words(answer: dict[str, Any]) -> str:
    return f"tip error {answer['tip']['peak_m'] * 1e3:.2f} mm of {answer['tolerance_m'] * 1e3:g} mm"


def _print(asked: _Asked, answer: dict[str, Any]) -> None:
    notes = list(answer.get("notes", ()))
    if "tip" in answer:
        _print_plan(asked, answer)
    if "before_after" in answer:
        models = answer["before_after"]
        _print_models(asked, models, alone="tip" not in answer)
        notes += models["notes"]
    if asked.whole:
        print_lines("note", notes)
    else:
        more = "noise, means" if "before_after" not in answer else "every part"
        print_lines(None, [f"{len(notes)} notes, {more}: --all lists them"])
    print_files(answer["files"])


def _print_plan(asked: _Asked, answer: dict[str, Any]) -> None:
    from planner.experiments import comparison

    times = f"{answer['samples']} samples from {answer['from_s']:.3f} to {answer['to_s']:.3f} s"
    print_lines(None, [f"{asked.measured} against {asked.planned}, {times}"])
    print_lines(None, [] if answer["verdict"] is None else [f"{answer['verdict']}: {_tolerance_words(answer)}"])
    print_lines(None, comparison.summary(answer))
    print_rows(comparison.ANSWER_HEADER, map(comparison.answer_cells, answer["joints"]), drop=("RMS", "at"))
    if asked.whole:
        for title, header, cells in (
            ("Positions, measured minus planned", comparison.POSITION_HEADER, comparison.position_cells),
            ("Torques of the measured motion minus those of the plan", comparison.TORQUE_HEADER, comparison.torque_cells),
            ("Torques of the log minus those of the model", comparison.LOGGED_HEADER, comparison.logged_cells),
        ):
            click.echo(title)
            print_rows(header, map(cells, answer["joints"]))


def _print_models(asked: _Asked, answer: dict[str, Any], alone: bool) -> None:
    from planner.experiments import residuals
    from planner.experiments.residual_report import verdict

    if alone:
        span = f"{answer['samples']} samples from {answer['from_s']:.3f} to {answer['to_s']:.3f} s"
        print_lines(None, [f"{asked.measured}: {span}, payload {answer['payload_kg']:g} kg"])
    print_lines(None, [f"{answer['after']} {verdict(answer)} than {answer['before']}"])
    print_lines("measured", answer["measured"])
    click.echo("Torque not explained, RMS, and what takes it away (share of its square)")
    print_rows(residuals.HEADER, map(residuals.cells, answer["joints"]))
    if asked.whole:
        print_rows(residuals.PARTS_HEADER, [row for joint in answer["joints"] for row in residuals.part_cells(joint)])
    print_lines(None, [residuals.tip_sentence(answer["tip"])])
