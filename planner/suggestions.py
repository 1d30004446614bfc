"""What would mend a move that cannot be made: the smallest single change of each kind, verified by planning again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from boom_model import JOINTS, ActuatorHorizontal, Boom, Drive, InfeasibleError
from planner.checks.motion_checks import Verdict
from planner.paths.targets import Target, resolve
from planner.planning import plan
from planner.progress import Track

_MOST = 4.0
"""The largest factor on a duration, a ratio or a drive that is tried."""

_COARSE = 0.05  # [s], the sampling step of a trial
_BISECTIONS = 8


Works = Callable[..., bool]
Change = Callable[[Boom, Sequence[int], float], Boom]


@dataclass(frozen=True)
class Remedy:
    """One change that makes the move possible, all else the same."""

    change: str
    """payload, duration, ratio, drive, limit or order."""
    sentence: str


def remedies(boom: Boom, start: Target, goal: Target, track: Track = iter, **options: Any) -> tuple[Remedy, ...]:
    """The least change of each kind with which `plan(boom, start, goal, **options)` succeeds and no check FAILs.

    Payload (less), duration (longer), the gear ratio of one joint (higher, all else of the sheet unchanged), the drive of one
    joint (its torques scaled), one joint's velocity, acceleration and jerk limits (higher; these three at all joints where
    no single one helps), and the order of the joints (the extension first, or last). Factors are looked for up to 4 and
    rounded to the safe side; each is planned with before it is offered. Empty where no single change helps, and where nothing
    is wrong.

    Args:
        track: iterates over the kinds of change, and may show how far it is.
        options: of `plan`.
    """

    coarse = {**options, "step": _COARSE, "rate": None}

    def works(changed: Boom = boom, **other: Any) -> bool:
        try:
            return plan(changed, start, goal, **{**coarse, **other}).report.verdict is not Verdict.FAIL
        except InfeasibleError:
            return False

    if works():
        return ()
    driven = [i for i, drive in enumerate(boom.drives) if drive is not None]
    kinds: list[Callable[[], Iterator[Remedy]]] = [
        partial(_payload, boom, works),
        partial(_duration, boom, works, start, goal, options),
        partial(_scaled, boom, works, "ratio", _geared, driven),
        partial(_scaled, boom, works, "drive", _stronger, driven),
        partial(_scaled, boom, works, "limit", _faster, range(5)),
        partial(_orders, boom, works, start, goal, options),
    ]
    return tuple(remedy for kind in track(kinds) for remedy in kind())


def _payload(boom: Boom, works: Works) -> Iterator[Remedy]:
    mass = boom.payload.mass
    if mass <= 0.0 or not works(boom.with_payload(0.0)):
        return
    good, bad = 0.0, mass
    for _ in range(_BISECTIONS):
        middle = (good + bad) / 2.0
        good, bad = (middle, bad) if works(boom.with_payload(middle)) else (good, middle)
    rounded = np.floor(good * 10.0) / 10.0
    if works(boom.with_payload(float(rounded))):
        yield Remedy("payload", f"a payload of {rounded:g} kg instead of {mass:g} kg")


def _duration(boom: Boom, works: Works, start: Target, goal: Target, options: dict[str, Any]) -> Iterator[Remedy]:
    given = options.get("duration")
    if given is None:
        return
    try:
        least = plan(boom, start, goal, **{**options, "step": _COARSE, "duration": None}).report.duration
    except InfeasibleError:
        return
    rounded = float(np.ceil(least * 100.0) / 100.0)
    if works(duration=rounded):
        yield Remedy("duration", f"a duration of {rounded:g} s instead of {given:g} s")


def _scaled(boom: Boom, works: Works, kind: str, change: Change, joints: Sequence[int]) -> Iterator[Remedy]:
    """The least factor at each joint by itself or, where none helps, at all of them."""
    found = False
    for which in ([i] for i in joints):
        factor = _least_factor(works, partial(change, boom, which))
        if factor is not None:
            found = True
            yield Remedy(kind, _SENTENCES[kind].format(joints=JOINTS[which[0]], factor=factor))
    if not found and len(joints) > 1:
        factor = _least_factor(works, partial(change, boom, joints))
        if factor is not None:
            names = ", ".join(JOINTS[i] for i in joints)
            yield Remedy(kind, _SENTENCES[kind].format(joints=names, factor=factor))


_SENTENCES = {
    "ratio": "gear ratio at {joints} {factor:.3g} times as high, with the other figures of the gearbox's sheet",
    "drive": "motor and gearbox at {joints} with {factor:.3g} times the torque, and no heavier",
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
            motor=replace(motor, running_torque=times(motor.running_torque), holding_torque=times(motor.holding_torque)),
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


def _orders(boom: Boom, works: Works, start: Target, goal: Target, options: dict[str, Any]) -> Iterator[Remedy]:
    if options.get("via") or not (isinstance(options.get("along", "joint"), str) and options.get("along", "joint") == "joint"):
        return
    pitch, hold = options.get("pitch", -np.pi / 2.0), options.get("hold") or ActuatorHorizontal()
    try:
        a = resolve(boom, start, pitch, hold)
        b = resolve(boom, goal, pitch, hold, reference=a)
    except InfeasibleError:
        return
    for name, moved_from, moved_to in (("first", a, b), ("last", b, a)):
        between = moved_from.copy()
        between[3] = moved_to[3]
        if boom.limits.hold(between) and works(via=[between]):
            yield Remedy("order", f"the extension {name}, by itself")


def _least_factor(works: Works, changed: Callable[[float], Boom]) -> float | None:
    """The least factor up to _MOST that works, rounded up to a hundredth; None where that does not."""
    if not works(changed(_MOST)):
        return None
    bad, good = 1.0, _MOST
    for _ in range(_BISECTIONS):
        middle = float(np.sqrt(bad * good))
        bad, good = (bad, middle) if works(changed(middle)) else (middle, good)
    rounded = float(np.ceil(good * 100.0) / 100.0)
    return rounded if works(changed(rounded)) else None


def _with_drives(boom: Boom, joints: Sequence[int], change: Callable[[Drive], Drive]) -> Boom:
    drives = (change(drive) if drive is not None and i in joints else drive for i, drive in enumerate(boom.drives))
    return replace(boom, drives=tuple(drives))
