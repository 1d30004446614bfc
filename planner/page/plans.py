"""A planned move of the page: what was asked, the motion, and the command that gives the same."""

import shlex
from dataclasses import MISSING, dataclass, fields, replace
from functools import cached_property

import numpy as np

from boom_model import Boom
from planner.move_spec import MoveSpec, MoveWords
from planner.page.vehicle import LEVEL_SLOPE, Slope
from planner.paths.targets import TipTarget
from planner.planning import Move, plan_move
from planner.recording.torque_speed import Plane, planes

BOOM_TOML, VEHICLE_TOML = "boom-page.toml", "vehicle-page.toml"
"""Names of the files that a command needs beside it, if the page changed drives or limits, or
tilted the vehicle."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A move that was planned and checked."""

    words: MoveWords
    slope: Slope
    move: Move

    @property
    def duration(self) -> float:
        """Return the duration [s]."""
        return self.move.trajectory.duration

    def sample(self, time: float) -> int:
        """Return the sample nearest to a time [s]."""
        return int(np.abs(self.move.trajectory.t - time).argmin())

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """Torque-speed plane of each motor with its operating points."""
        return tuple(planes(self.move))


def text_of(value: float) -> str:
    """Return a number with all its digits, and no more.

    >>> text_of(60.0), text_of(0.1)
    ('60', '0.1')
    """
    return repr(value).removesuffix(".0")


def spec_of(words: MoveWords, slope: Slope) -> MoveSpec:
    """Return the move of the page's words, on its slope unless they name a vehicle case.

    Raises:
        InputError: as `MoveWords.spec`.
    """
    spec = words.spec()
    return spec if words.vehicle is not None else replace(spec, vehicle=slope.case)


def make_plan(boom: Boom, words: MoveWords, slope: Slope) -> Planned:
    """Plan and check a move.

    Raises:
        InputError: as `plan_move`.
        InfeasibleError: as `plan_move`.
    """
    return Planned(words, slope, plan_move(boom, spec_of(words, slope)))


def command_line(
    words: MoveWords,
    slope: Slope,
    *,
    payload: float | None = None,
    boom_file: str | None = None,
    catalogue_file: str | None = None,
    changed: bool = False,
) -> str:
    """Return the `boom plan` command that gives the page's plan.

    Args:
        words: the move.
        slope: of the vehicle; another than level or that of a named case needs VEHICLE_TOML.
        payload: at the tip [kg]; None is that of the boom's file.
        boom_file: the boom's file that the page was started with.
        catalogue_file: the catalogue that the page was started with.
        changed: whether drives or limits were changed; they need BOOM_TOML.
    """
    parts = ["boom", "plan", words.start, words.goal]
    tips = any(isinstance(target, TipTarget) for target in words.spec().targets)
    for each in fields(words):
        if each.default is MISSING or (each.name in ("pitch", "constraint") and not tips):
            continue
        value, option = getattr(words, each.name), f"--{each.name.replace('_', '-')}"
        if value == each.default:
            continue
        if isinstance(value, bool):
            parts.append(option)
        elif isinstance(value, tuple):
            parts += [part for text in value for part in (option, text)]
        else:
            parts += [option, text_of(value) if isinstance(value, float) else value]
    if payload is not None:
        parts += ["--payload", text_of(payload)]
    if words.vehicle is None and slope != LEVEL_SLOPE:
        parts += ["--vehicle", VEHICLE_TOML]
    source = BOOM_TOML if changed else boom_file
    for option, name in (("--boom", source), ("--catalogue", catalogue_file)):
        if name is not None:
            parts += [option, name]
    return shlex.join(parts)
