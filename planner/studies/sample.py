"""One sample of a study, and a chunk of them as a table: from factors' values to responses."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import Boom, Catalogue, InfeasibleError, InputError
from boom_model.boom_file import boom_of
from planner.checks.evaluation import at_samples
from planner.checks.motion_checks import check_rows
from planner.checks.rows import Verdict
from planner.missions.mission import Mission, mission_of, plan_cycle
from planner.studies.designed_link import link_task, with_designed_link
from planner.studies.responses import LABELS, responses, unknown_response
from planner.studies.study import Case, Inputs, Study
from planner.studies.tables import Tree, Value, filled, get, put, scaled

if TYPE_CHECKING:
    import pyarrow as pa

DONE, INFEASIBLE, REFUSED = "done", "infeasible", "refused"
"""Status of a sample: checked; no motion was found, which counts as FAIL; its values make no boom,
drive or mission."""

Points = Sequence[tuple[int, str, tuple[Value, ...]]]
"""Index, kind and values of each point."""


def compute(case: Case, values: Sequence[Value]) -> dict[str, Any]:
    """Return the columns of a sample: status, reason and responses.

    It depends on its arguments alone.

    Args:
        case: the study's inputs.
        values: one for each factor.
    """
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            return {"status": DONE, "reason": None, **_answer(case, values)}
    except InfeasibleError as error:
        return {"status": INFEASIBLE, "reason": str(error), "verdict": str(Verdict.FAIL)}
    except InputError as error:
        return {"status": REFUSED, "reason": str(error), "verdict": None}
    except (ArithmeticError, RecursionError) as error:
        return {"status": REFUSED, "reason": f"the numbers are beyond what can be computed: {error}", "verdict": None}


def check_responses(study: Study) -> None:
    """Check by the first point of a study that its responses are numbers that samples have.

    A first point without an answer tells nothing.

    Raises:
        InputError: a response or a name of the Pareto front is unknown, or no number.
    """
    found = compute(study.case, study.design.values(0))
    if found["status"] != DONE:
        return
    for name in (*study.responses, *study.pareto):
        if name not in found and name not in LABELS:
            raise unknown_response(name, found)
        if isinstance(found.get(name), str):
            raise InputError(f"response {name}: it is not a number")


def compute_chunk(case: Case, points: Points, seed: int) -> "pa.Table":
    """Return the rows of some points as a table, one row a point, refused ones among them."""
    import pyarrow as pa

    rows = []
    for index, point, values in points:
        factors = {f.name: value if f.numeric else str(value) for f, value in zip(case.factors, values, strict=True)}
        fixed = {"sample": index, "point": point, "seed": seed, **factors}
        rows.append({**fixed, "tightest": None, "failing": None, **compute(case, values)})
    names = list(dict.fromkeys(name for row in rows for name in row))
    return pa.table({name: _column([row.get(name) for row in rows]) for name in names})


def make(case: Case, values: Sequence[Value]) -> tuple[Boom, Mission, Inputs]:
    """Return the boom, the mission and the changed inputs of a sample, before any link is designed.

    Raises:
        InputError: the values make no boom, no drive or no mission.
    """
    trees: dict[str, Tree] = dict(vars(case.inputs))
    named = {factor.name: value for factor, value in zip(case.factors, values, strict=True)}
    payload: float | None = None
    for factor, value in zip(case.factors, values, strict=True):
        for key in factor.keys:
            root, _, rest = key.partition(".")
            if key == "payload":
                payload = _number(factor.name, value)
            elif key == "profile":
                trees["mission"] = {**trees["mission"], "steps": _with_profile(trees["mission"]["steps"], value)}
            else:
                path = tuple(rest.split("."))
                new = scaled(get(trees[root], path), float(value)) if factor.relative else value
                trees[root] = put(trees[root], path, new)
    inputs = Inputs(**trees)
    boom = boom_of(inputs.boom, Catalogue.of(inputs.catalogue, "the catalogue"), "the boom")
    if payload is not None:
        boom = boom.with_payload(payload)
    return boom, mission_of(filled(inputs.mission, named), "the mission"), inputs


def _answer(case: Case, values: Sequence[Value]) -> dict[str, Any]:
    boom, mission, inputs = make(case, values)
    cycle = plan_cycle(boom, mission, step=case.step)
    task, link_mass = link_task(inputs.link), None
    if task is not None:
        boom, link_mass = with_designed_link(boom, task, inputs.links, cycle)
        cycle = plan_cycle(boom, mission, step=case.step)
    bears = boom.mount.force is not None or boom.mount.moment is not None
    evaluation = at_samples(boom, cycle.trajectory, reactions=bears)
    found = responses(evaluation, cycle, check_rows(evaluation, cycle.duty), case.joints)
    return found if link_mass is None else {**found, "link_kg": link_mass}


def _number(name: str, value: Value) -> float:
    if isinstance(value, str):
        raise InputError(f"factor {name}: {value!r} is not a number")
    return float(value)


def _with_profile(steps: Any, profile: Value) -> list[Any]:
    """Return the steps of a mission with another profile of every move."""
    changed = []
    for step in steps:
        if "to" in step:
            step = {**step, "profile": profile}
        if "steps" in step:
            step = {**step, "steps": _with_profile(step["steps"], profile)}
        changed.append(step)
    return changed


def _column(values: list[Any]) -> "pa.Array":
    """Return a column of numbers, texts or nothing, of a type that does not depend on the chunk."""
    import pyarrow as pa

    known = [value for value in values if value is not None]
    if not known:
        return pa.nulls(len(values))
    if all(type(value) is int for value in known):
        return pa.array(values, pa.int64())
    return pa.array(values, pa.string() if isinstance(known[0], str) else pa.float64())
