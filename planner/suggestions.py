"""Smallest single changes that make a move possible, each verified by planning again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from boom_model import JOINTS, Boom, Drive, InfeasibleError
from planner.bisection import bisect
from planner.checks.certificate import certificate_of
from planner.checks.evaluation import evaluate
from planner.checks.motion_checks import check_rows
from planner.checks.rows import Verdict, overall
from planner.move_spec import MoveSpec
from planner.paths.targets import resolve
from planner.planning import plan_motion
from planner.progress import Track
from planner.timing.profile import TimeOptimal

_MAX_FACTOR = 4.0
"""Largest factor tried on a gear ratio, a drive or limits."""

_TRIAL_STEP = 0.05  # [s], sampling step of a trial
_BISECTIONS = 8

Change = Callable[[Boom, Sequence[int], float], Boom]


@dataclass(frozen=True)
class Suggestion:
    """Single change that makes the move possible with everything else unchanged."""

    change: str
    """Kind of change: payload, duration, ratio, drive, limit or order."""
    sentence: str
    """Change in words, with its value."""
    boom: Boom = field(repr=False, compare=False)
    """The boom with the change."""
    spec: MoveSpec = field(repr=False, compare=False)
    """The move with the change."""


def suggestions(boom: Boom, spec: MoveSpec, track: Track = iter) -> tuple[Suggestion, ...]:
    """Find the least change of each kind with which a move can be planned and no check FAILs.

    The kinds are:

    - a smaller payload
    - a longer duration
    - a higher gear ratio at one joint, with the other figures of its datasheet unchanged
    - a stronger drive at one joint, with its torques scaled
    - higher velocity, acceleration and jerk limits of one joint
    - another order of the joints: the extension first or last

    If no single joint helps, gear ratio, drive and limits are changed at all joints together.
    Factors are searched up to 4 and rounded to the safe side. Each suggestion is verified by
    planning with it. The result is empty if no single change helps or if nothing is wrong.

    Args:
        boom: the boom.
        spec: the move.
        track: iterates over the kinds of change, and may show progress.

    Raises:
        InputError: as `plan_move`.
    """
    asked, spec = spec, replace(spec, step=_TRIAL_STEP, rate=None)
    if works(boom, spec):
        return ()
    driven = [i for i, drive in enumerate(boom.drives) if drive is not None]
    kinds: list[Callable[[], Iterator[Suggestion]]] = [
        partial(_payload, boom, spec),
        partial(_duration, boom, spec),
        partial(_scaled, boom, spec, "ratio", _geared, driven),
        partial(_scaled, boom, spec, "drive", _stronger, driven),
        partial(_scaled, boom, spec, "limit", _faster, range(5)),
        partial(_orders, boom, spec),
    ]
    found = (suggestion for kind in track(kinds) for suggestion in kind())
    return tuple(replace(each, spec=replace(each.spec, step=asked.step, rate=asked.rate)) for each in found)


def works(boom: Boom, spec: MoveSpec) -> bool:
    """Return whether a move can be planned and no check FAILs."""
    try:
        planned = plan_motion(boom, spec)
    except InfeasibleError:
        return False
    reactions = boom.mount.force is not None or boom.mount.moment is not None
    evaluation = evaluate(boom, planned, vehicle=spec.vehicle, reactions=reactions)
    certificate = certificate_of(evaluation)
    if certificate is not None and certificate.broken:
        return False
    return overall(check_rows(evaluation)) is not Verdict.FAIL


def _payload(boom: Boom, spec: MoveSpec) -> Iterator[Suggestion]:
    mass = boom.payload.mass

    def carries(payload: float) -> bool:
        return works(boom.with_payload(payload), spec)

    if mass <= 0.0 or not carries(0.0):
        return
    rounded = float(np.floor(bisect(carries, good=0.0, bad=mass, steps=_BISECTIONS) * 10.0) / 10.0)
    if carries(rounded):
        yield Suggestion("payload", f"a payload of {rounded:g} kg instead of {mass:g} kg", boom.with_payload(rounded), spec)


def _duration(boom: Boom, spec: MoveSpec) -> Iterator[Suggestion]:
    if spec.duration is None:
        return
    try:
        profile = TimeOptimal() if spec.profile.needs_duration else spec.profile
        least = plan_motion(boom, replace(spec, profile=profile, duration=None)).duration
    except InfeasibleError:
        return
    rounded = float(np.ceil(least * 100.0) / 100.0)
    longer = replace(spec, duration=rounded)
    if works(boom, longer):
        yield Suggestion("duration", f"a duration of {rounded:g} s instead of {spec.duration:g} s", boom, longer)


def _scaled(boom: Boom, spec: MoveSpec, kind: str, change: Change, joints: Sequence[int]) -> Iterator[Suggestion]:
    """Yield the least factor for each single joint or, if none helps, for all joints together."""
    found = False
    for which in ([i] for i in joints):
        factor = _least_factor(spec, partial(change, boom, which))
        if factor is not None:
            found = True
            sentence = _SENTENCES[kind].format(joints=JOINTS[which[0]], factor=factor)
            yield Suggestion(kind, sentence, change(boom, which, factor), spec)
    if not found and len(joints) > 1:
        factor = _least_factor(spec, partial(change, boom, joints))
        if factor is not None:
            names = ", ".join(JOINTS[i] for i in joints)
            sentence = _SENTENCES[kind].format(joints=names, factor=factor)
            yield Suggestion(kind, sentence, change(boom, joints, factor), spec)


_SENTENCES = {
    "ratio": "gear ratio of {joints} {factor:.3g} times as high, with the gearbox otherwise unchanged",
    "drive": "motor and gearbox of {joints} with {factor:.3g} times the torque and the same mass",
    "limit": "velocity, acceleration and jerk limits of {joints} {factor:.3g} times as high",
}


def _geared(boom: Boom, joints: Sequence[int], factor: float) -> Boom:
    def geared(drive: Drive) -> Drive:
        return replace(drive, gearbox=replace(drive.gearbox, ratio=drive.gearbox.ratio * factor))

    return _with_drives(boom, joints, geared)


def _stronger(boom: Boom, joints: Sequence[int], factor: float) -> Boom:
    def times(value: float | None) -> float | None:
        return None if value is None else value * factor

    def stronger(drive: Drive) -> Drive:
        motor, gear = drive.motor, drive.gearbox
        return replace(
            drive,
            motor=replace(
                motor,
                running_torque=times(motor.running_torque),
                holding_torque=times(motor.holding_torque),
                rated_torque=times(motor.rated_torque),
                peak_torque=times(motor.peak_torque),
            ),
            gearbox=replace(
                gear,
                start_stop_torque=times(gear.start_stop_torque),
                max_average_torque=times(gear.max_average_torque),
                peak_torque=times(gear.peak_torque),
                continuous_torque=times(gear.continuous_torque),
            ),
        )

    return _with_drives(boom, joints, stronger)


def _faster(boom: Boom, joints: Sequence[int], factor: float) -> Boom:
    scale = np.where(np.isin(np.arange(5), joints), factor, 1.0)
    limits = boom.limits
    velocity, acceleration, jerk = (rate * scale for rate in (limits.velocity, limits.acceleration, limits.jerk))
    return replace(boom, limits=replace(limits, velocity=velocity, acceleration=acceleration, jerk=jerk))


def _orders(boom: Boom, spec: MoveSpec) -> Iterator[Suggestion]:
    if spec.via or not (isinstance(spec.along, str) and spec.along == "joint"):
        return
    try:
        a = resolve(boom, spec.start, spec.pitch, spec.constraint)
        b = resolve(boom, spec.goal, spec.pitch, spec.constraint, reference=a)
    except InfeasibleError:
        return
    for name, moved_from, moved_to in (("first", a, b), ("last", b, a)):
        between = moved_from.copy()
        between[3] = moved_to[3]
        apart = replace(spec, via=(between,))
        if boom.limits.contain(between) and works(boom, apart):
            yield Suggestion("order", f"move the extension {name}, separately", boom, apart)


def _least_factor(spec: MoveSpec, changed: Callable[[float], Boom]) -> float | None:
    """Return the least factor that works, rounded up to a hundredth.

    None if no factor up to _MAX_FACTOR works, or if the rounded one does not.
    """

    def helps(factor: float) -> bool:
        return works(changed(factor), spec)

    if not helps(_MAX_FACTOR):
        return None
    rounded = float(np.ceil(bisect(helps, good=_MAX_FACTOR, bad=1.0, steps=_BISECTIONS, geometric=True) * 100.0) / 100.0)
    return rounded if helps(rounded) else None


def _with_drives(boom: Boom, joints: Sequence[int], change: Callable[[Drive], Drive]) -> Boom:
    for i in joints:
        drive = boom.drives[i]
        boom = boom if drive is None else boom.with_drive(JOINTS[i], change(drive))
    return boom
