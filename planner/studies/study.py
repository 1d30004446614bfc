"""A study as its TOML file gives it: mission, factors, design and responses."""

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from boom_model import JOINTS, InputError
from boom_model.boom_file import BOOM_FILE
from boom_model.drives.catalogue import CATALOGUE_FILE
from boom_model.link_design.link import LINKS_FILE
from boom_model.plausible import DURATION
from boom_model.toml_file import Table, parse_toml, validated
from boom_model.words import unknown
from planner.files import named_file
from planner.missions.mission import mission_file
from planner.motion.trajectory import STEP
from planner.studies.designed_link import LINK_FIELDS
from planner.studies.designs import Design, DesignKind, design
from planner.studies.factors import Factor
from planner.studies.tables import Tree, Value, is_numeric, merged, require_key, texts
from planner.timing.profile import SHORTEST

NAMED_STUDIES = Path(str(files("planner.studies") / "named_studies"))
"""Folder of the studies that come with the toolkit."""

_CHUNKS = 100
_LEAST_CHUNK, _MOST_CHUNK = 10, 250
"""Samples of a chunk, where a study of about _CHUNKS of them would have fewer or more."""

SHORT_KEYS = ("payload", "profile")
"""Keys without a file: the mass at the tip with its inertia, and the profile of every move."""

_ROOTS = ("boom", "catalogue", "links", "link", "mission")
_Number = Annotated[float, Field(allow_inf_nan=False)]


class _FactorTable(Table):
    name: Annotated[str, Field(min_length=1)]
    key: str | None = None
    keys: list[str] = Field(default_factory=list)
    relative: bool = False
    values: list[Value] | Literal["all"] | None = None
    distribution: Literal["uniform", "normal", "triangular"] | None = None
    low: _Number | None = None
    high: _Number | None = None
    levels: Annotated[int, Field(ge=2, le=100_000)] | None = None
    mean: _Number | None = None
    std: _Number | None = None
    mode: _Number | None = None
    basis: Literal["printed", "estimated", "assumed"] = "assumed"
    source: Annotated[str, Field(min_length=1)]

    @model_validator(mode="after")
    def _one_law(self) -> "_FactorTable":
        if self.key is not None and self.keys:
            raise ValueError("give key or keys, not both")
        needs = {"uniform": {"low", "high"}, "normal": {"mean", "std"}, "triangular": {"low", "mode", "high"}}
        if self.values is not None:
            law, needed = "values", {"values"}
        elif self.levels is not None:
            law, needed = "levels", {"levels", "low", "high"}
        elif self.distribution is not None:
            law, needed = self.distribution, {"distribution", *needs[self.distribution]}
        else:
            raise ValueError("give values, or low, high and levels, or a distribution")
        of_law = {"values", "levels", "distribution", "low", "high", "mean", "std", "mode"}
        given = {name for name in of_law if getattr(self, name) is not None}
        if given != needed:
            raise ValueError(f"{law} takes {', '.join(sorted(needed))}; given are {', '.join(sorted(given))}")
        if self.values == []:
            raise ValueError("values has no value")
        return self


class _MoveTable(Table):
    start: str
    goal: str
    profile: str = "cubic"
    duration_s: Annotated[float, DURATION] | None = None
    constraint: str = "horizontal"
    pitch: str = "down"
    along: str = "joint"


class _StudyTable(Table):
    name: Annotated[str, Field(min_length=1)]
    question: Annotated[str, Field(min_length=1)]
    mission: str | None = None
    move: _MoveTable | None = None
    joints: list[str] = Field(default_factory=list)
    design: DesignKind = Field(strict=False)
    samples: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 1
    chunk: Annotated[int, Field(ge=1, le=100_000)] | None = None
    step_s: Annotated[float, Field(ge=1e-4, le=1.0)] = STEP
    responses: list[str] = Field(default_factory=lambda: ["used", "duration_s", "tip_error_m"])
    pareto: list[str] = Field(default_factory=list)
    boundary: str | None = None
    link: dict[str, Any] = Field(default_factory=dict)
    links: dict[str, Any] = Field(default_factory=dict)
    boom: dict[str, Any] = Field(default_factory=dict)
    catalogue: dict[str, Any] = Field(default_factory=dict)
    factors: Annotated[list[_FactorTable], Field(min_length=1)]

    @model_validator(mode="after")
    def _whole(self) -> "_StudyTable":
        if (self.mission is None) == (self.move is None):
            raise ValueError("give either mission or a table [move]")
        names = [factor.name for factor in self.factors]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"two factors are named {', '.join(twice)}")
        if self.boundary is not None and (self.boundary not in names or self.design is not DesignKind.GRID):
            raise ValueError(f"boundary is {self.boundary}; it must be a factor of a grid ({', '.join(names)})")
        return self


@dataclass(frozen=True)
class Inputs:
    """The files that a sample is made from, as nested tables."""

    boom: Tree
    catalogue: Tree
    links: Tree
    mission: Tree
    link: Tree
    """Fields of a `LinkTask`; empty without a designed link."""


@dataclass(frozen=True)
class Case:
    """All that a worker needs to compute a sample from the values of its factors."""

    inputs: Inputs
    factors: tuple[Factor, ...]
    joints: tuple[str, ...]
    """Joints whose rows decide; () is everything."""
    step: float
    """Longest sampling step of the moves [s]."""


@dataclass(frozen=True, eq=False)
class Study:
    """A study with its design."""

    name: str
    question: str
    work: str
    """Mission or move in words."""
    case: Case
    design: Design
    samples: int
    """As the file or the command gives them."""
    seed: int
    chunk: int
    """Samples that a process computes at a time. The dataset does not depend on it."""
    responses: tuple[str, ...]
    pareto: tuple[str, ...]
    """Responses of which the least are sought; () is none."""
    boundary: str | None
    """Factor of a grid of which the largest level without a FAIL is sought."""


def named_studies() -> tuple[str, ...]:
    """Return the names of the studies that come with the toolkit."""
    return tuple(sorted(path.stem for path in NAMED_STUDIES.glob("*.toml")))


def load_study(
    name: str,
    *,
    samples: int | None = None,
    seed: int | None = None,
    boom: str | None = None,
    catalogue: str | None = None,
    links: str | None = None,
) -> Study:
    """Load a named study, or one from a TOML file (a name that ends in .toml).

    Args:
        name: name or file.
        samples: number of samples in place of the file's.
        seed: in place of the file's.
        boom: a boom's file; None is the shipped one.
        catalogue: drives of the user's own beside the shipped ones.
        links: a file of plates and fittings; None is the shipped one.

    Raises:
        InputError: a file cannot be read or is malformed, a key is unknown, or a distribution is
            impossible; the message names it.
    """
    file = named_file(NAMED_STUDIES, name, "study")
    table = validated(str(file), parse_toml(file), _StudyTable)
    inputs = _inputs(table, boom, catalogue, links)
    for joint in table.joints:
        if joint not in JOINTS:
            raise unknown("joint", joint, JOINTS)
    factors = tuple(_factor(f, inputs, str(file)) for f in table.factors)
    count = table.samples if samples is None else samples
    start = table.seed if seed is None else seed
    points = design(table.design, factors, count, start)
    if table.move is None:
        work = f"mission {table.mission}"
    else:
        varied = any("profile" in factor.keys for factor in factors)
        work = f"{table.move.start} to {table.move.goal}" + ("" if varied else f", {table.move.profile}")
    return Study(
        name=table.name,
        question=table.question,
        work=work,
        case=Case(inputs, factors, tuple(table.joints), table.step_s),
        design=points,
        samples=count,
        seed=start,
        chunk=table.chunk or min(max(len(points) // _CHUNKS, _LEAST_CHUNK), _MOST_CHUNK),
        responses=tuple(table.responses),
        pareto=tuple(table.pareto),
        boundary=_bounded(table.boundary, factors, str(file)),
    )


def _inputs(table: _StudyTable, boom: str | None, catalogue: str | None, links: str | None) -> Inputs:
    known = parse_toml(CATALOGUE_FILE)
    if catalogue is not None:
        own = parse_toml(Path(catalogue))
        for kind, entries in own.items():
            for entry in entries if isinstance(entries, dict) else ():
                if entry in known.get(kind, {}):
                    raise InputError(f"{catalogue}: key {kind}.{entry}: the catalogue already has an entry of this name")
        known = merged(known, own)
    if table.move is not None:
        move = table.move.model_dump(exclude_none=True)
        start, goal = move.pop("start"), move.pop("goal")
        shared = {key: move[key] for key in ("pitch", "constraint")}
        source = {"name": f"{start} to {goal}", "basis": "assumed", "source": f"study {table.name}"}
        mission: Tree = {**source, "start": start, **shared, "steps": [{"to": goal, **move}]}
    else:
        mission = parse_toml(mission_file(str(table.mission)))
    link = dict(table.link)
    for key in link:
        if key not in LINK_FIELDS:
            raise unknown("key of [link]", key, LINK_FIELDS)
    return Inputs(
        boom=merged(parse_toml(BOOM_FILE if boom is None else Path(boom)), table.boom),
        catalogue=merged(known, table.catalogue),
        links=merged(parse_toml(LINKS_FILE if links is None else Path(links)), table.links),
        mission=mission,
        link=link,
    )


def _factor(table: _FactorTable, inputs: Inputs, file: str) -> Factor:
    keys = tuple(table.keys) if table.key is None else (table.key,)
    where = f"{file}: factor {table.name}"
    if not keys and not any(f"{{{table.name}}}" in text for text in texts(inputs.mission)):
        raise InputError(f"{where}: it has no key, and {{{table.name}}} stands nowhere in the mission or move")
    for key in keys:
        _check_key(key, table.relative, inputs, where)
    values = table.values
    if values == "all":
        values = list(_all_values(keys, inputs, where))
    levels: tuple[Value, ...] = tuple(float(v) if is_numeric(v) else v for v in values or ())
    if table.levels is not None and table.low is not None and table.high is not None:
        if not table.low < table.high:
            raise InputError(f"{where}: low is {table.low:g} and high is {table.high:g}; low must be below high")
        width = (table.high - table.low) / (table.levels - 1)
        levels = tuple(table.low + width * i for i in range(table.levels))
    if table.relative and not all(map(is_numeric, levels)):
        raise InputError(f"{where}: it is relative, so its values must be numbers")
    normal = table.distribution == "normal"
    return Factor(
        name=table.name,
        keys=keys,
        relative=table.relative,
        levels=levels,
        shape=table.distribution,
        low=(table.mean if normal else table.low) or 0.0,
        high=(table.std if normal else table.high) or 0.0,
        mode=table.mode or 0.0,
        basis=table.basis,
        source=table.source,
    )


def _bounded(name: str | None, factors: tuple[Factor, ...], file: str) -> str | None:
    """Return the name of a factor whose levels can be ordered."""
    if name is not None and not all(factor.numeric for factor in factors if factor.name == name):
        raise InputError(f"{file}: boundary is {name}; its values must be numbers")
    return name


def _check_key(key: str, relative: bool, inputs: Inputs, where: str) -> None:
    root, _, rest = key.partition(".")
    if key in SHORT_KEYS:
        if relative:
            raise InputError(f"{where}: {key} takes no relative values; give its own")
        return
    if root not in _ROOTS or not rest:
        raise unknown(f"key of {where.rpartition(': ')[2]}", key, (*SHORT_KEYS, *(f"{name}.KEY" for name in _ROOTS)))
    if root == "link":
        if rest not in LINK_FIELDS:
            raise unknown(f"key of {where.rpartition(': ')[2]}", key, (f"link.{name}" for name in LINK_FIELDS))
        if relative:
            raise InputError(f"{where}: {key} takes no relative values; give its own")
        return
    if root == "mission" and not relative and rest.rpartition(".")[2] in ("profile", "duration_s"):
        require_key(inputs.mission, rest.rpartition(".")[0], where)  # a step may leave these two out
        return
    found = require_key(getattr(inputs, root), rest, where)
    if relative and not is_numeric(found):
        raise InputError(f"{where}: key {key} is {found!r}, which a relative value cannot multiply")


def _all_values(keys: tuple[str, ...], inputs: Inputs, where: str) -> tuple[str, ...]:
    last = {key.rpartition(".")[2] for key in keys}
    every = {
        "motor": tuple(inputs.catalogue.get("motors", {})),
        "gearbox": tuple(inputs.catalogue.get("gearboxes", {})),
        "profile": tuple(map(str, SHORTEST)),
    }
    if len(last) != 1 or not last <= set(every):
        raise InputError(f'{where}: values = "all" is for a motor, a gearbox or a profile')
    return every[last.pop()]
