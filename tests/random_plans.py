"""Seeded random plans: from moves of a nanoradian to moves across every range, on every kind of
path.

A plan is found again by its number alone. Every third one leads the tip under a constraint that
chooses.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import Generator

from boom_model import (
    ActuatorAngle,
    BaseMotion,
    Boom,
    Constraint,
    FixedExtension,
    LargestMargin,
    LeastExtension,
    LeastTorque,
    NearestHorizontal,
    forward_kinematics,
    up_on_slope,
)
from boom_model.arrays import Array
from planner import TipTarget
from planner.paths.legs import Along, legs
from planner.paths.targets import Target
from planner.timing.profile import SHORTEST, Profile
from planner.timing.time_law import Motion
from planner.timing.timing import Timing, timed

BOOM = Boom.load()
LIMITS = BOOM.limits
SEED = 13
CHOICES = (LeastExtension(), NearestHorizontal(), LargestMargin(), LeastTorque())
KINDS = [*((profile, {}) for profile in SHORTEST), (Profile.TIME_OPTIMAL, {"jerk_bound": True})]
MOST_PAYLOAD = 45.0  # [kg]; from some 25 kg on, the drives cannot hold it everywhere
SMALLEST = 1e-9  # share of a whole move


@dataclass(frozen=True, eq=False)
class RandomPlan:
    """What `plan` would be asked for."""

    number: int
    boom: Boom
    targets: tuple[Target, ...]
    pitch: float
    constraint: Constraint
    along: Along
    stops: bool
    base: BaseMotion | None
    profile: str
    options: dict[str, Any] = field(default_factory=dict)
    """Of `Timing.of`."""

    @property
    def chooses(self) -> bool:
        return self.constraint in CHOICES

    def motions(self) -> tuple[Motion, ...]:
        """The motions of the plan, without any check.

        Raises:
            BoomError: the plan is refused.
        """
        timing = Timing.of(self.profile, **self.options)
        paths, _ = legs(self.boom, self.targets, self.pitch, self.constraint, self.along, self.stops)
        return timed(self.boom, paths, timing, self.base) if paths else ()


def random_plan(number: int) -> RandomPlan:
    """The plan of that number."""
    rng = np.random.default_rng([SEED, number])
    boom = BOOM.with_payload(float(rng.uniform(0.0, MOST_PAYLOAD)) if rng.random() < 0.8 else 0.0)
    base = BaseMotion.of(up=up_on_slope(*rng.uniform(-0.3, 0.3, 2))) if rng.random() < 0.25 else None
    profile, options = KINDS[rng.integers(len(KINDS))]
    timing = dict(options)
    if rng.random() < 0.25:
        timing["rate"] = float(10.0 ** rng.uniform(0.5, 3.0))
    if rng.random() < 0.15:
        timing["duration"] = float(10.0 ** rng.uniform(0.0, 2.0))
    if profile is Profile.TIME_OPTIMAL and rng.random() < 0.05:
        timing["average_torque"] = True
    kind = number % 3
    if kind == 2 or (kind == 1 and rng.random() < 0.5):
        tip = _on_a_curve(rng, chooses=kind == 2)
        return RandomPlan(number, boom, *tip, True, base, profile, timing)
    count = 2 if kind == 0 else int(rng.integers(3, 6))
    stops = kind == 0 or rng.random() < 0.3
    if kind == 1 and not stops and profile is Profile.CUBIC and rng.random() < 0.3:
        timing["velocities"] = rng.uniform(-0.3, 0.3, (count - 2, 5)) * LIMITS.velocity
    targets = tuple(_poses(rng, count))
    return RandomPlan(number, boom, targets, -np.pi / 2.0, ActuatorAngle(0.0), "joint", stops, base, profile, timing)


def _size(rng: Generator) -> float:
    """Share of a whole move: half of all are whole ones, the others down to SMALLEST."""
    return 1.0 if rng.random() < 0.5 else float(SMALLEST ** rng.uniform(0.0, 1.0))


def _pose(rng: Generator) -> Array:
    while True:
        q = rng.uniform(LIMITS.lower, LIMITS.upper)
        if LIMITS.contain(q):
            return q


def _poses(rng: Generator, count: int) -> list[Array]:
    """Poses within the limits, a few of their joints left where they were."""
    first, found = _pose(rng), []
    for _ in range(count):
        moves = (rng.random(5) < 0.8) * _size(rng)
        q = first + moves * (_pose(rng) - first)
        found.append(q if LIMITS.contain(q) else first + moves.max() * (_pose(rng) - first))
    return [first, *found[1:]]


def _on_a_curve(rng: Generator, chooses: bool) -> tuple[tuple[Target, ...], float, Constraint, Along]:
    """Targets, pitch, constraint and line or arc: its ends are tips of poses with the pitch and the
    constraint."""
    start = _pose(rng)
    fixed = int(rng.choice([2, 3]))  # the lower link or the extension
    poses = [start]
    while len(poses) < 2:
        q = start + _size(rng) * (_pose(rng) - start)
        if not chooses:
            q[fixed] = start[fixed]
        q[4] = start[2] + start[4] - q[2]  # the same pitch
        if LIMITS.contain(q):
            poses.append(q)
    tips = forward_kinematics(BOOM, np.array(poses))
    pitch = float(tips.pitch[0])
    constraint: Constraint = ActuatorAngle(float(start[2] - np.pi)) if fixed == 2 else FixedExtension(float(start[3]))
    if chooses:
        constraint = CHOICES[rng.integers(len(CHOICES))]
    a, b = tips.position
    targets = tuple(TipTarget(tuple(place.tolist())) for place in (a, b))
    if rng.random() < 0.7:
        return targets, pitch, constraint, "line"
    aside = np.cross(rng.normal(size=3), b - a)
    aside *= np.linalg.norm(b - a) / max(float(np.linalg.norm(aside)), 1e-30)
    return targets, pitch, constraint, (a + b) / 2.0 + rng.uniform(0.05, 0.6) * aside
