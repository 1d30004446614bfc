"""State of one tab: a frozen value, and the pure functions that change it.

Every field of the page holds a text. `asked` has the texts as they were typed; the other attributes
have what was last accepted. A text that is refused leaves them as they are, and `complaints` says
why.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from boom_model import (
    JOINTS,
    Boom,
    BoomError,
    Catalogue,
    Constraint,
    FixingConstraint,
    InfeasibleError,
    InputError,
    Solutions,
    forward_kinematics,
    inverse_kinematics,
    nearest_reachable,
)
from boom_model.arrays import Array, read_only
from boom_model.boom import IS_LENGTH, in_degrees
from boom_model.kinematics.constraints import parse_constraint
from boom_model.plausible import DURATION, MASS, RATE, SLOPE
from boom_model.words import joint_position, number
from planner.move_spec import MoveWords
from planner.page.drives import fitted, supplies_of, with_drive
from planner.page.plans import Planned, text_of
from planner.page.vehicle import LEVEL_SLOPE, OWN, Slope, slope_of
from planner.page.workspace import Workspace
from planner.paths.targets import TipTarget, parse_pitch, parse_target
from planner.suggestions import Suggestion

TARGET = ("x", "y", "z", "pitch", "constraint")
"""Fields of the tip target."""
FLAGS = ("pass_via", "jerk_bound", "average_torque")
"""Fields that hold "yes" or nothing."""
MOVE = ("start", "via", "goal", "profile", "along", "duration", "rate", *FLAGS)
"""Fields of a move. `via` holds targets with semicolons."""
LIMITS = ("velocity", "acceleration", "jerk")
"""Limits of a joint that a suggestion may raise."""


def drive_field(joint: str) -> str:
    """Return the name of the field that chooses a joint's drive."""
    return f"drive_{joint}"


_ANGLE_DIGITS, _LENGTH_DIGITS = 9, 12  # rounding of a branch's joints, in degrees and metres: far below the limits' tolerance


@dataclass(frozen=True)
class TargetWords:
    """Tip target in words, with the pitch and constraint that all tip targets share."""

    x: float
    y: float
    z: float
    pitch: str = "down"
    constraint: str = "horizontal"

    @property
    def position(self) -> tuple[float, float, float]:
        """Position in frame 1 [m]."""
        return self.x, self.y, self.z

    @property
    def is_quick(self) -> bool:
        """Whether a solution takes a millisecond: one joint is fixed, and the pitch given."""
        return isinstance(parse_constraint(self.constraint), FixingConstraint) and self.pitch != "free"


@dataclass(frozen=True, eq=False)
class Branches:
    """Solutions for a tip target, and why none of them can be taken."""

    target: TargetWords
    found: Solutions
    reason: str | None
    """None if a branch is within the limits."""
    chosen: int | None
    """Index of the branch that the boom shows."""


@dataclass(frozen=True, eq=False)
class State:
    """What one tab of the page shows."""

    boom: Boom
    """With the payload and the drives of the page."""
    boom_file: str | None
    catalogue_file: str | None
    catalogue: Catalogue
    joints: tuple[float, ...]
    """Joint position: degrees, the extension in metres."""
    target: TargetWords
    move: MoveWords
    original: Boom
    """As its file has it."""
    slope: Slope = LEVEL_SLOPE
    branches: Branches | None = None
    planned: Planned | None = None
    time: float | None = None
    """Time in the planned motion that the boom shows [s]; None shows the joint position of the
    sliders."""
    failure: str = ""
    """Why the last move could not be planned."""
    suggestions: tuple[Suggestion, ...] = ()
    swapped: Mapping[str, str] = field(default_factory=dict)
    """Drives chosen on the page by joint, which the boom's file does not have."""
    unwritten: tuple[str, ...] = ()
    """Changes of the boom that no file can hold."""
    workspace: Workspace | None = None
    asked: Mapping[str, str] = field(default_factory=dict)
    complaints: Mapping[str, str] = field(default_factory=dict)

    @property
    def raised(self) -> tuple[tuple[str, str], ...]:
        """Joints and names of the limits that the page has raised."""
        was, now = self.original.limits, self.boom.limits
        return tuple(
            (joint, name) for i, joint in enumerate(JOINTS) for name in LIMITS if getattr(was, name)[i] != getattr(now, name)[i]
        )

    @property
    def has_own_boom(self) -> bool:
        """Whether a command needs a file of the page's boom."""
        return bool(self.swapped or self.raised)

    @property
    def q(self) -> Array:
        """Joint position (5,) of the sliders [rad, m]."""
        return joint_position("pose", words_of(self.joints))

    @property
    def shown_q(self) -> Array:
        """Joint position (5,) that the boom shows: the sliders', or the motion's at its time."""
        if self.time is None or self.planned is None:
            return self.q
        shown: Array = self.planned.move.trajectory.q[self.planned.sample(self.time)]
        return shown


def first_state(
    boom: Boom, boom_file: str | None = None, catalogue_file: str | None = None, payload: float | None = None
) -> State:
    """Return a new tab's state: at the last named pose, with a move from the first to it.

    Args:
        boom: the boom of the file.
        boom_file: its file; None is the shipped one.
        catalogue_file: drives beside the shipped ones.
        payload: another payload than the file's [kg].

    Raises:
        InputError: the catalogue cannot be read, or the payload is not plausible.
    """
    poses = list(boom.poses) or [f"q={words_of(shown(np.array((boom.limits.lower + boom.limits.upper) / 2.0)))}"]
    state = State(
        boom=boom if payload is None else boom.with_payload(payload),
        boom_file=boom_file,
        catalogue_file=catalogue_file,
        catalogue=Catalogue.load().with_file(catalogue_file),
        joints=(0.0,) * 5,
        target=TargetWords(0.0, 0.0, 0.0),
        move=MoveWords(poses[0], poses[-1]),
        original=boom,
    )
    drives = {drive_field(joint): fitted(boom, joint) for joint in JOINTS}
    asked = drives | {
        "payload": text_of(state.boom.payload.mass),
        "roll": "0",
        "nose": "0",
        "vehicle": OWN,
        "pitch": "down",
        "constraint": "horizontal",
    }
    asked |= {"start": poses[0], "goal": poses[-1], "via": "", "profile": "cubic", "along": "joint", "duration": "", "rate": ""}
    return edited(replace(state, asked=asked | dict.fromkeys(FLAGS, "")), "pose", poses[-1])


def edited(state: State, name: str, text: str) -> State:
    """Return the state after a field was changed; a refused text leaves a complaint alone."""
    asked = replace(state, asked={**state.asked, name: text})
    try:
        return _SETTERS[name](asked, text)
    except BoomError as error:
        return replace(asked, complaints={**asked.complaints, name: str(error)})


def solve(boom: Boom, target: TargetWords, near: Array) -> Branches:
    """Return the branches for a tip target; slow unless it `is_quick`.

    Args:
        boom: the boom.
        target: the target.
        near: joint position (5,); of several branches within the limits the nearest to it is
            chosen.
    """
    pitch, constraint = parse_pitch(target.pitch), parse_constraint(target.constraint)
    found = inverse_kinematics(boom, target.position, pitch, constraint, near)
    return Branches(target, found, _reason(boom, target, found, constraint), found.best)


def with_branches(state: State, branches: Branches) -> State:
    """Return the state with solutions of its target; those of another target are dropped."""
    if branches.target != state.target:
        return state
    state = replace(_clear(state, *TARGET), branches=branches)
    if branches.chosen is None:
        return replace(state, complaints={**state.complaints, "x": branches.reason or ""})
    return _at(state, _rounded(branches.found.solutions[branches.chosen].q), follow=False)


def with_branch(state: State, index: int) -> State:
    """Return the state with another branch; one outside the limits is refused with its reasons."""
    if state.branches is None or not 0 <= index < len(state.branches.found.solutions):
        return state
    solution = state.branches.found.solutions[index]
    if not solution.within_limits:
        said = f"branch {index + 1}: {', '.join(solution.reasons)}"
        return replace(state, complaints={**state.complaints, "branch": said})
    state = replace(_clear(state, *TARGET, "branch"), branches=replace(state.branches, chosen=index))
    return _at(state, _rounded(solution.q), follow=False)


def next_branch(state: State, step: int) -> State:
    """Return the state with the next branch within the limits, or for -1 the one before."""
    if state.branches is None:
        return state
    within = [i for i, solution in enumerate(state.branches.found.solutions) if solution.within_limits]
    if not within:
        return state
    chosen = state.branches.chosen
    at = within.index(chosen) if chosen in within else -1
    return with_branch(state, within[(at + step) % len(within)])


def pose_word(state: State) -> str:
    """Return the sliders' joint position as `boom plan` takes it: a pose's name, or q=..."""
    for name, q in state.boom.poses.items():
        if np.array_equal(q, state.q):
            return name
    return f"q={words_of(state.joints)}"


def words_of(joints: tuple[float, ...]) -> str:
    """Return a joint position in degrees and metres as the command takes it after q=."""
    return ",".join(text_of(value) for value in joints)


def shown(q: Array) -> tuple[float, ...]:
    """Return a joint position (5,) in degrees, the extension in metres."""
    return tuple(float(value) for value in in_degrees(q))


def _rounded(q: Array) -> tuple[float, ...]:
    digits = (_LENGTH_DIGITS if length else _ANGLE_DIGITS for length in IS_LENGTH)
    return tuple(round(value, places) + 0.0 for value, places in zip(shown(q), digits, strict=True))


def _reason(boom: Boom, target: TargetWords, found: Solutions, constraint: Constraint) -> str | None:
    """Return why no branch can be taken; the branches' own reasons are beside them."""
    if found.best is not None:
        return None
    why = "reached only outside the limits" if found.solutions else "out of reach"
    at = ", ".join(f"{x:.6g}" for x in target.position)
    said = f"tip ({at}) m with pitch {np.degrees(found.pitch):.4g} deg and constraint {constraint}: {why}"
    nearest = nearest_reachable(boom, target.position, found.pitch, constraint) if target.is_quick else None
    if nearest is None or not nearest.within_limits:
        return said
    near = ", ".join(f"{x:.4g}" for x in nearest.position)
    return f"{said}; the nearest point on the line to the base is ({near}) m, {nearest.distance:.3g} m away"


def _at(state: State, joints: tuple[float, ...], *, follow: bool = True) -> State:
    """Return the state at a joint position within the limits; its target may follow the tip."""
    q = joint_position("pose", words_of(joints))
    reasons = state.boom.limits.reasons(q)
    if reasons:
        raise InfeasibleError("; ".join(reasons))
    moved = replace(_clear(state, *JOINTS, "pose"), joints=joints, time=None)
    asked = dict(zip(JOINTS, map(text_of, joints), strict=True)) | {"pose": pose_word(moved)}
    if follow:
        x, y, z = (round(float(value), 6) + 0.0 for value in forward_kinematics(state.boom, q).position)
        asked |= {"x": text_of(x), "y": text_of(y), "z": text_of(z)}
        moved = replace(_clear(moved, *TARGET, "branch"), target=replace(state.target, x=x, y=y, z=z), branches=None)
    return replace(moved, asked={**moved.asked, **asked})


def _clear(state: State, *names: str) -> State:
    if not any(name in state.complaints for name in names):
        return state
    return replace(state, complaints={name: said for name, said in state.complaints.items() if name not in names})


def _joint(name: str) -> Callable[[State, str], State]:
    def put(state: State, text: str) -> State:
        number(name, text, "a number")
        joints = tuple(number(each, state.asked[each], "a number") for each in JOINTS)
        return _at(state, joints)

    return put


def _pose(state: State, text: str) -> State:
    target = parse_target(text.strip())
    if isinstance(target, TipTarget):
        raise InputError(f"{text}: give a tip's position under Target")
    if isinstance(target, str):
        return _at(state, _rounded(state.boom.pose(target)))
    return _at(state, tuple(float(part) for part in text.partition("=")[2].split(",")))


def _payload(state: State, text: str) -> State:
    mass = number("payload", text, "a number of kg")
    MASS.require("payload", mass)
    return changed_boom(_clear(state, "payload"), state.boom.with_payload(mass))


def _slope(name: str) -> Callable[[State, str], State]:
    def put(state: State, text: str) -> State:
        value = number(name, text, "a number of degrees")
        SLOPE.require(name, value)
        asked = {**state.asked, "vehicle": OWN}
        move, slope = replace(state.move, vehicle=None), replace(state.slope, **{name: value})
        return _without_plan(replace(_clear(state, name), asked=asked, move=move, slope=slope))

    return put


def _vehicle(state: State, text: str) -> State:
    """Take a named case with its slope; the slope stays where the case is left again."""
    if text == OWN:
        return _without_plan(replace(_clear(state, "vehicle"), move=replace(state.move, vehicle=None)))
    slope = slope_of(text)
    asked = {**state.asked, "roll": text_of(slope.roll), "nose": text_of(slope.nose)}
    state = replace(_clear(state, "vehicle", "roll", "nose"), asked=asked, slope=slope)
    return _without_plan(replace(state, move=replace(state.move, vehicle=text)))


def _drive(joint: str) -> Callable[[State, str], State]:
    def put(state: State, text: str) -> State:
        boom = with_drive(state.boom, state.catalogue, joint, text, supplies_of(state.original))
        others = {name: drive for name, drive in state.swapped.items() if name != joint}
        swapped = others if text == fitted(state.original, joint) else others | {joint: text}
        return changed_boom(replace(_clear(state, drive_field(joint)), swapped=swapped), boom)

    return put


def _target(name: str) -> Callable[[State, str], State]:
    def put(state: State, text: str) -> State:
        asked = state.asked
        x, y, z = (number(each, asked[each], "a number of metres") for each in "xyz")
        pitch, constraint = asked["pitch"], asked["constraint"]
        parse_pitch(pitch)
        parse_constraint(constraint)
        return _with_words(replace(_clear(state, name), target=TargetWords(x, y, z, pitch, constraint)))

    return put


def _move(name: str) -> Callable[[State, str], State]:
    def put(state: State, text: str) -> State:
        return _with_words(_clear(state, name))

    return put


def _with_words(state: State) -> State:
    """Return the state with the move that its fields describe."""
    words = _words(state)
    if words.duration is not None:
        DURATION.require("duration", words.duration)
    if words.rate is not None:
        RATE.require("rate", words.rate)
    for target in words.spec().targets:
        if isinstance(target, str):
            state.boom.pose(target)
    return replace(_clear(state, *MOVE), move=words)


def _words(state: State) -> MoveWords:
    asked = state.asked
    duration, rate = asked["duration"].strip(), asked["rate"].strip()
    return MoveWords(
        start=asked["start"].strip(),
        goal=asked["goal"].strip(),
        via=tuple(part.strip() for part in asked["via"].split(";") if part.strip()),
        profile=asked["profile"],
        along=asked["along"],
        duration=number("duration", duration, "a number of seconds") if duration else None,
        rate=number("rate", rate, "a number of Hz") if rate else None,
        pass_via=bool(asked["pass_via"]),
        jerk_bound=bool(asked["jerk_bound"]),
        average_torque=bool(asked["average_torque"]),
        vehicle=state.move.vehicle,
        pitch=state.target.pitch,
        constraint=state.target.constraint,
    )


def changed_boom(state: State, boom: Boom) -> State:
    """Return the state with another boom, without the old one's plan and workspace."""
    return replace(_without_plan(state), boom=boom, workspace=None)


def _without_plan(state: State) -> State:
    return replace(state, planned=None, time=None, failure="", suggestions=())


def with_plan(state: State, planned: Planned) -> State:
    """Return the state with a planned move, shown at its start."""
    return replace(state, planned=planned, time=0.0, failure="", suggestions=())


def with_failure(state: State, reason: str) -> State:
    """Return the state without a plan, and why there is none."""
    return replace(_without_plan(state), failure=reason)


def at_time(state: State, time: float) -> State:
    """Return the state with the boom at a time [s] of its planned motion."""
    if state.planned is None:
        return state
    return replace(state, time=float(np.clip(time, 0.0, state.planned.duration)))


def with_suggestion(state: State, suggestion: Suggestion) -> State:
    """Return the state with a suggestion applied to its boom or its move."""
    spec, words = suggestion.spec, state.asked
    if suggestion.change == "duration" and spec.duration is not None:
        return edited(state, "duration", text_of(spec.duration))
    if suggestion.change == "payload":
        return edited(state, "payload", text_of(suggestion.boom.payload.mass))
    if suggestion.change == "order":
        between = [f"q={words_of(_rounded(np.asarray(target, dtype=float)))}" for target in spec.via]
        return edited(state, "via", "; ".join([*filter(None, [words["via"]]), *between]))
    if suggestion.change == "limit":
        return changed_boom(state, _with_written_limits(suggestion.boom))
    return replace(changed_boom(state, suggestion.boom), unwritten=(*state.unwritten, suggestion.sentence))


def written_limits(boom: Boom, name: str) -> tuple[float, ...]:
    """Return the limits of a name in degrees and metres, as the page writes them."""
    return _rounded(getattr(boom.limits, name))


def _with_written_limits(boom: Boom) -> Boom:
    """Return the boom with the limits that its file will have, to the last digit."""

    def read(name: str) -> Array:
        texts = np.array(written_limits(boom, name))
        return read_only(np.where(IS_LENGTH, texts, np.radians(texts)))

    velocity, acceleration, jerk = map(read, LIMITS)
    return replace(boom, limits=replace(boom.limits, velocity=velocity, acceleration=acceleration, jerk=jerk))


_SETTERS: dict[str, Callable[[State, str], State]] = {
    "pose": _pose,
    "payload": _payload,
    **{name: _joint(name) for name in JOINTS},
    **{drive_field(name): _drive(name) for name in JOINTS},
    **{name: _slope(name) for name in ("roll", "nose")},
    "vehicle": _vehicle,
    **{name: _target(name) for name in TARGET},
    **{name: _move(name) for name in MOVE},
}
