"""Results of a study as text, Markdown and JSON."""

import re
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from planner.reports.markdown import section, table
from planner.studies.analysis import CONFIDENCE, FAILS, Index, Probability, ResponseSummary, Results
from planner.studies.designs import DesignKind
from planner.studies.responses import label
from planner.studies.sample import INFEASIBLE, REFUSED
from planner.studies.tables import Value

RESPONSE_HEADER = ("response", "nominal", "5 %", "median", "95 %", "sd", "first order", "decided by")
INDEX_HEADER = ("factor", "share alone", "+-", "share in all", "+-", "values")
LEVEL_HEADER = ("factor", "level", "FAIL", "95 % interval", "samples")
_FEW = 12
_MOST_COMBINATIONS = 40


def sentences(results: Results) -> tuple[str, ...]:
    """Return what was asked, and the answer in words."""
    study, found = results.study, results.fails()
    asked = f"study {study.name}: {study.question}"
    design = study.design
    drawn = f"{len(results.refused):,} samples of {len(design.factors)} factors ({design.kind}, seed {study.seed})"
    how = f"{study.work}, {drawn}"
    counted = [
        f"{mask.sum():,} {word}"
        for mask, word in ((results.infeasible, "without a motion"), (results.refused, "refused"))
        if mask.any()
    ]
    if found is None:
        answer = "no sample could be checked"
    elif study.design.kind is DesignKind.GRID:
        answer = f"{found.fails} of {found.samples} FAIL"
    else:
        answer = f"FAIL: {chance(found)}"
    return asked, how, "; ".join([answer, ", ".join(counted)] if counted else [answer])


def chance(found: Probability) -> str:
    """Return a probability with its interval in words."""
    return (
        f"{percent(found.estimate)} of {found.samples:,} "
        f"({CONFIDENCE:.0%} interval {percent(found.low)} to {percent(found.high)})"
    )


def percent(share: float) -> str:
    """Return a share as a percentage of two digits or more."""
    return f"{100.0 * share:.3g} %" if abs(share) < 0.995 else f"{100.0 * share:.4g} %"


def summaries(results: Results) -> tuple[ResponseSummary, ...]:
    """Return the summaries of the study's responses that some sample has."""
    return (
        ()
        if results.refused.all()
        else tuple(found for name in results.study.responses if (found := results.summary(name)) is not None)
    )


def told(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of a table without the columns that hold "-" in every row."""
    kept = [i for i in range(len(header)) if not rows or any(row[i] != "-" for row in rows)]
    return tuple(header[i] for i in kept), [tuple(row[i] for i in kept) for row in rows]


def response_rows(found: Sequence[ResponseSummary]) -> list[tuple[str, ...]]:
    """Return the rows of RESPONSE_HEADER."""
    rows = []
    for each in found:
        name, size = label(each.name)
        figures = (each.nominal, *each.quantiles, each.deviation, each.first_order)
        rows.append((name, *("-" if x is None else _number(x / size) for x in figures), decided_by(each)))
    return rows


def decided_by(found: ResponseSummary) -> str:
    """Return the factor that decides a response, with its share of the variance."""
    if found.indices:
        first = found.indices[0]
        return f"{first.factor} ({percent(first.rank)})"
    varying = [swing for swing in found.swings if swing.high > swing.low]
    return varying[0].factor if varying else "-"


def index_rows(results: Results, indices: Sequence[Index]) -> list[tuple[str, ...]]:
    """Return the rows of INDEX_HEADER."""
    exact = results.study.design.kind is DesignKind.GRID
    laws = {factor.name: factor.law for factor in results.study.design.factors}
    return [
        (
            index.factor,
            f"{index.first:.3f}",
            "-" if exact else f"{index.first_error:.3f}",
            "-" if index.total is None else f"{index.total:.3f}",
            "-" if exact or index.total_error is None else f"{index.total_error:.3f}",
            laws[index.factor],
        )
        for index in indices
    ]


def level_rows(results: Results) -> list[tuple[str, ...]]:
    """Return the rows of LEVEL_HEADER, for factors of several levels but few."""
    few = {factor.name for factor in results.study.design.factors if 1 < len(factor.levels) <= _FEW}
    grid = results.study.design.kind is DesignKind.GRID
    return [
        (
            name,
            level,
            percent(found.estimate),
            "-" if grid else f"{percent(found.low)} to {percent(found.high)}",
            f"{found.samples:,}",
        )
        for name, level, found in results.by_level()
        if name in few and found is not None
    ]


def combination_rows(results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of the probability of FAIL by combination of levels.

    There are no rows where there are many combinations.
    """
    names = [factor.name for factor in results.study.design.factors if len(factor.levels) > 1]
    found = results.by_combination()
    rows = [(*shown, percent(p.estimate), f"{percent(p.low)} to {percent(p.high)}", f"{p.samples:,}") for shown, p in found]
    return (*names, *LEVEL_HEADER[2:]), rows if len(rows) <= _MOST_COMBINATIONS else []


def boundary_rows(results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of the largest level without a FAIL; no rows where none is sought."""
    name = results.study.boundary
    others = [factor.name for factor in results.study.design.factors if factor.name != name]
    rows = [
        (
            *each.others,
            "none" if each.largest is None else _number(each.largest),
            _short(each.then),
        )
        for each in results.boundary()
    ]
    return (*others, f"largest {name}", "then the limit is"), rows


def front_points(results: Results) -> list[dict[str, Value]]:
    """Return the points of the Pareto front.

    Each has the responses of which the least are sought, and the factors that vary. () where the
    study has none.
    """
    study = results.study
    if not study.pareto:
        return []
    names = [factor.name for factor in study.design.factors]
    varied = {factor.name for factor in study.design.factors if len(factor.levels) != 1}
    points = []
    for i in map(int, results.front(study.pareto)):
        values = zip(names, study.design.values(i), strict=True)
        own: dict[str, Value] = {name: float(results.numbers(name)[i]) for name in study.pareto}
        points.append(own | {name: value for name, value in values if name in varied})
    return points


def front_rows(results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of the Pareto front as people read it; no rows where there is none."""
    points = front_points(results)
    header = tuple(label(name)[0] for name in points[0]) if points else ()
    return header, [tuple(_value(value, label(name)[1]) for name, value in point.items()) for point in points]


def notes(results: Results) -> tuple[str, ...]:
    """Return what was varied on what basis, and why samples were refused or have no motion."""
    factors = results.study.design.factors
    said = [f"{f.name}: {f.law}; {f.basis}: {f.source}" for f in factors]
    for status, word in ((REFUSED, "refused"), (INFEASIBLE, "without a motion")):
        for reason, count in results.reasons(status)[:_FEW]:
            said.append(f"{count:,} {word}{', such as' if count > 1 else ''}: {reason}")
    said += [f"tightest limit in {count:,} samples: {name}" for name, count in results.tightest()[:_FEW]]
    return tuple(said)


def to_markdown(results: Results) -> str:
    """Return the report of a study."""
    asked, how, answer = sentences(results)
    found = summaries(results)
    lines = [f"# {asked}", "", how, "", answer, "", "## Responses", ""]
    lines += table(*told(RESPONSE_HEADER, response_rows(found)))
    if any(each.first_order is not None for each in found):
        lines += ["", "*First order* is the standard deviation by first-order propagation of the factors' deviations."]
    for name, indices in _indexed(results, found):
        lines += ["", f"## What decides {label(name)[0]}", "", *table(*told(INDEX_HEADER, index_rows(results, indices)))]
    levels = level_rows(results)
    if levels:
        lines += ["", "## By level", "", *table(*told(LEVEL_HEADER, levels))]
    if results.study.design.kind is not DesignKind.GRID:
        header, rows = combination_rows(results)
        if rows:
            lines += ["", "## By combination of levels", "", *table(header, rows)]
    header, rows = boundary_rows(results)
    if rows:
        lines += ["", f"## How large {results.study.boundary} may be", "", *table(header, rows)]
    header, rows = front_rows(results)
    if rows:
        lines += [
            "",
            f"## Pareto front of least {', '.join(label(name)[0] for name in results.study.pareto)}",
            "",
            *table(header, rows),
        ]
    lines += section("Factors and notes", notes(results))
    return "\n".join(lines) + "\n"


def to_json(results: Results, files: dict[str, str]) -> dict[str, Any]:
    """Return the JSON object of `boom study`, in SI."""
    study, found = results.study, results.fails()
    responses = [asdict(each) | {"indices": [asdict(index) for index in each.indices]} for each in summaries(results)]
    return {
        "study": study.name,
        "question": study.question,
        "work": study.work,
        "design": str(study.design.kind),
        "seed": study.seed,
        "samples": len(results.refused),
        "infeasible": int(results.infeasible.sum()),
        "refused": int(results.refused.sum()),
        "probability_of_FAIL": None if found is None else asdict(found) | {"estimate": found.estimate},
        "what_decides_FAIL": [asdict(index) for index in results.indices(FAILS)],
        "by_level": [
            {"factor": name, "level": level, **asdict(each), "estimate": each.estimate}
            for name, level, each in results.by_level()
            if each is not None
        ],
        "by_combination": [
            {"levels": list(levels), **asdict(each), "estimate": each.estimate} for levels, each in results.by_combination()
        ],
        "boundary": [asdict(each) for each in results.boundary()],
        "responses": responses,
        "pareto": front_points(results),
        "factors": [
            {"name": f.name, "keys": list(f.keys), "law": f.law, "basis": f.basis, "source": f.source}
            for f in study.design.factors
        ],
        "files": files,
    }


def _indexed(results: Results, found: Sequence[ResponseSummary]) -> list[tuple[str, tuple[Index, ...]]]:
    """Return the responses with indices, FAIL first."""
    named = [(FAILS, results.indices(FAILS)), *((each.name, each.indices) for each in found)]
    return [(name, indices) for name, indices in named if indices]


def _short(then: str | None) -> str:
    """Return the end of a way in few words.

    Of a sentence about a mission, this is what is out of reach or too fast.
    """
    if then is None:
        return "nothing up to the largest level"
    return re.sub(r"^mission .*?, steps [^:]*: ", "", then).partition(";")[0]


def _number(value: float) -> str:
    return f"{float(f'{value:.4g}'):.12g}"


def _value(value: Value, size: float) -> str:
    return _number(value / size) if isinstance(value, float) else str(value)
