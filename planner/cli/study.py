"""Studies: many variants of a boom on a mission."""

from typing import TYPE_CHECKING, Any

import click

from boom_model import InputError
from planner.cli.completion import OutFile, studies
from planner.cli.options import all_option, boom_option, given_catalogue, json_option, outputs, report_option
from planner.cli.printing import ANSWER_IS_NO, complain, print_files, print_json, print_lines, print_rows, tracked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.files import Outputs
    from planner.studies.analysis import Results


@click.command()
@click.argument("study", shell_complete=studies)
@click.option("--out", type=OutFile(".parquet"), metavar="FILE.parquet", help="The dataset. Default: the study's name.")
@click.option("--picture", type=OutFile(".png"), metavar="FILE.png", help="Tornado, indices, samples, Pareto front.")
@report_option
@click.option("--samples", type=click.IntRange(1), metavar="N", help="Number of samples; otherwise the file's.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), metavar="N", help="Seed; otherwise the file's.")
@click.option("--workers", type=click.IntRange(1, 1024), metavar="N", help="Local processes. Default: one for each core.")
@click.option("--scheduler", metavar="tcp://HOST:8786", help="A Dask scheduler that runs, in place of local processes.")
@click.option("--resume", is_flag=True, help="Go on with a run that was stopped.")
@click.option("--links", type=click.Path(), metavar="FILE.toml", help="Plates and fittings of your own links.")
@boom_option
@all_option
@json_option
def study(
    study: str,
    out: str | None,
    picture: str | None,
    document: str | None,
    samples: int | None,
    seed: int | None,
    workers: int | None,
    scheduler: str | None,
    resume: bool,
    links: str | None,
    boom_file: str | None,
    whole: bool,
    as_json: bool,
) -> int:
    """Vary a boom, its drives and its mission; show how often it FAILs, and what decides.

    STUDY is a FILE.toml, or one of lighter-boom, lighter-motor, payload-reach and tolerance.

    \b
    Examples:
      boom study tolerance --report tolerance.pdf
      boom study mine.toml --scheduler tcp://10.0.0.1:8786 --resume
    """
    from planner.studies.analysis import Results
    from planner.studies.engine import run
    from planner.studies.sample import check_responses
    from planner.studies.store import Store
    from planner.studies.study import load_study

    if scheduler is not None and workers is not None:
        raise InputError("--workers is for local processes; a scheduler has workers of its own")
    catalogue = given_catalogue()
    asked = load_study(study, samples=samples, seed=seed, boom=boom_file, catalogue=catalogue, links=links)
    check_responses(asked)
    dataset = out or f"{asked.name}.parquet"
    files = outputs(dataset, picture, document=document, inputs=(study, boom_file, links))
    store = Store(dataset, asked)
    with store.opened(resume):
        run(store, workers=workers, scheduler=scheduler, track=tracked(f"study {asked.name}"))
        with files:
            store.join(files.temporary(dataset))
            results = Results(asked, files.temporary(dataset))
            written = {"dataset": dataset} | _written(files, results, picture, document)
        store.remove()
    _print(results, written, whole, as_json)
    if results.refused.all():
        complain("no sample could be checked: every one was refused")
        return ANSWER_IS_NO
    return 0


def _written(files: "Outputs", results: "Results", picture: str | None, document: str | None) -> dict[str, str]:
    """Write picture and report where they have a name."""
    from planner.reports.document import write_document
    from planner.studies.pictures import study_pictures, write_study_picture
    from planner.studies.report import to_markdown

    written = {}
    if picture is not None:
        write_study_picture(files.temporary(picture), results)
        written["picture"] = picture
    if document is not None:
        write_document(files.temporary(document), to_markdown(results), study_pictures(results))
        written["report"] = document
    return written


def _print(results: "Results", written: dict[str, str], whole: bool, as_json: bool) -> None:
    from planner.studies import report

    if as_json:
        print_json(report.to_json(results, written))
        return
    print_lines(None, report.sentences(results))
    found = report.summaries(results)
    if found:
        print_rows(*report.told(report.RESPONSE_HEADER, report.response_rows(found)), drop=("first order", "sd", "nominal"))
    for header, rows, few in _details(results):
        if rows:
            print_rows(*report.told(header, rows if whole else rows[:few]))
    said = report.notes(results)
    if whole:
        print_lines("note", said)
    else:
        print_lines(None, [f"{len(said)} notes on factors and samples: --all lists them"])
    print_files(written)
    if "report" not in written:
        print_lines("next", [f"boom study {results.study.name} --report {results.study.name}.pdf"])


def _details(results: "Results") -> list[tuple[tuple[str, ...], list[Any], int]]:
    """Return the tables of the answer, each with the number of rows shown without --all."""
    from planner.studies import report
    from planner.studies.analysis import FAILS

    header, front = report.front_rows(results)
    levels = report.level_rows(results)
    indices = report.index_rows(results, results.indices(FAILS))
    bounds = report.boundary_rows(results)
    if bounds[1]:
        return [(*bounds, 12)]
    first = [] if front else [(report.LEVEL_HEADER, levels, _whole_factors(levels, 7))]
    return [*first, (report.INDEX_HEADER, indices, 2), (header, front, 6)]


def _whole_factors(levels: "Sequence[tuple[str, ...]]", most: int) -> int:
    """Return how many rows of levels to show, at most so many, keeping a factor's rows together."""
    if len(levels) <= most:
        return len(levels)
    return max(k for k in range(most + 1) if k == 0 or levels[k - 1][0] != levels[k][0])
