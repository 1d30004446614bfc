"""Small studies, and datasets of functions whose answers are known."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from boom_model.arrays import Array
from planner.studies.analysis import Results
from planner.studies.designs import DesignKind, design
from planner.studies.factors import Factor
from planner.studies.study import Case, Inputs, Study

SMALL = """
name = "small"
question = "Does it hold?"
mission = "table-3-1"
joints = ["inner"]
design = "monte-carlo"
samples = {samples}
seed = 3
chunk = 5
step_s = 0.1
responses = ["used"]

[[factors]]
name = "payload"
key = "payload"
distribution = "normal"
mean = 10.0
std = 1.0
source = "this test"

[[factors]]
name = "link mass"
keys = ["boom.bodies.inner.mass_kg"]
relative = true
distribution = "uniform"
low = 0.9
high = 1.1
source = "this test"
"""
"""A study of a few milliseconds a sample."""


def uniform(name: str, low: float, high: float) -> Factor:
    """A factor that changes nothing, with a uniform distribution."""
    return Factor(name, (), False, shape="uniform", low=low, high=high)


def normal(name: str, mean: float, std: float) -> Factor:
    """A factor that changes nothing, with a normal distribution."""
    return Factor(name, (), False, shape="normal", low=mean, high=std)


def results_of(
    path: Path,
    function: Callable[[Array], Array],
    factors: list[Factor],
    kind: DesignKind,
    samples: int,
    *,
    fail_above: float = np.inf,
    seed: int = 7,
    refused: list[int] | None = None,
    pareto: tuple[str, ...] = (),
    boundary: str | None = None,
    more: dict[str, Array] | None = None,
) -> Results:
    """The dataset of a function y(coordinates) as a study would write it; it FAILs where y is above
    a bound."""
    points = design(kind, factors, samples, seed)
    y = function(points.coordinates)
    off = np.isin(np.arange(len(y)), refused or [])
    columns = {
        "point": [points.point(i) for i in range(len(y))],
        "status": np.where(off, "refused", "done").tolist(),
        "reason": [f"the mass is -{i}.5e-3 kg" if bad else None for i, bad in enumerate(off)],
        "verdict": [None if bad else "FAIL" if value > fail_above else "PASS" for bad, value in zip(off, y, strict=True)],
        "tightest": ["y"] * len(y),
        "y": np.where(off, np.nan, y),
        **(more or {}),
    }
    pq.write_table(pa.table(columns), path / "y.parquet")
    case = Case(Inputs({}, {}, {}, {}, {}), tuple(factors), (), 0.1)
    study = Study("test", "what?", "a function", case, points, samples, seed, 5, ("y",), pareto, boundary)
    return Results(study, path / "y.parquet")
