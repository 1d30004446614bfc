"""What a move is doing over time: phase, deciding limit and brakes; with entries of a log."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint import encodings

from boom_model import JOINTS
from boom_model.arrays import Array
from planner.planning import Move
from planner.recording.palette import GREEN, GREY, ORANGE, SKY_BLUE, VERMILION, Color
from planner.recording.torque_ratio import torque_ratios

AT_LIMIT = 0.99
"""Share of a limit from which on it counts as met."""

_LIMIT = "states/limit"
_NO_LIMIT, _REST = "none", "at rest"
_ALIKE = 6  # decimals
_STEADY = 1e-3  # of the largest rate: slower changes of speed are none
_PHASES = {"accelerating": GREEN, "steady": SKY_BLUE, "braking": ORANGE, _REST: GREY}
_BRAKES = {"engaged": GREY, "released": GREEN}


@dataclass(frozen=True)
class Lane:
    """A quantity that has one of a few states at any time."""

    entity: str
    states: Sequence[str]
    """(n,) state at each sample."""
    colors: dict[str, Color]


def lanes(move: Move) -> tuple[Lane, ...]:
    """Return the lanes of a move: phase, active limit and, where a drive has a brake, brakes."""
    found = [
        Lane("states/phase", phases(move), _PHASES),
        Lane(_LIMIT, active_limits(move), {_NO_LIMIT: GREY}),
    ]
    if any(drive is not None and drive.brake is not None and drive.brake.value for drive in move.boom.drives):
        still = _at_rest(move)
        found.append(Lane("states/brakes", ["engaged" if rests else "released" for rests in still], _BRAKES))
    return tuple(found)


def phases(move: Move) -> list[str]:
    """Return the phase at each sample, from the change of speed up to the next sample.

    Speed is the largest of the joints' speeds, each as a share of its limit.
    """
    t, limits = move.trajectory.t, move.boom.limits
    speed = (np.abs(move.trajectory.qd) / limits.velocity).max(axis=-1)
    if len(t) < 2:
        return [_REST] * len(t)
    steps = np.diff(t)
    change = np.append(np.where(steps > 0.0, np.diff(speed) / np.where(steps > 0.0, steps, 1.0), 0.0), 0.0)
    scale = np.abs(change).max() * _STEADY
    named = np.where(change > scale, "accelerating", np.where(change < -scale, "braking", "steady"))
    return [str(phase) for phase in np.where(_at_rest(move), _REST, named)]


def active_limits(move: Move) -> list[str]:
    """Return the limit that the motion is nearest to at each sample, and none below AT_LIMIT."""
    motion, limits = move.trajectory, move.boom.limits
    rates = {"velocity": motion.qd / limits.velocity, "acceleration": motion.qdd / limits.acceleration}
    if motion.qddd is not None:
        rates["jerk"] = motion.qddd / limits.jerk
    names = [f"{name} of {joint}" for name in rates for joint in JOINTS]
    ratios = [np.abs(ratio) for ratio in rates.values()]
    drives = torque_ratios(move.boom, motion, move.loads.tau)
    names += [f"drive torque of {joint}" for joint in drives]
    every = np.concatenate([*ratios, *(ratio[:, None] for ratio in drives.values())], axis=-1)
    worst = np.round(every, _ALIKE).argmax(axis=-1)  # of limits met together the first, not by rounding
    met = every.max(axis=-1) >= AT_LIMIT
    return [names[at] if at_limit else _NO_LIMIT for at, at_limit in zip(worst, met, strict=True)]


def log_lanes(recording: rr.RecordingStream, t: Array, shown: Sequence[Lane]) -> None:
    """Log each lane where its state changes, at times t (n,)."""
    for lane in shown:
        known = list(dict.fromkeys(lane.states))
        colors = [lane.colors.get(state, VERMILION) for state in known]
        recording.log(lane.entity, rr.StateConfiguration(values=known, labels=known, colors=colors), static=True)
        for k in _changes(lane.states):
            recording.set_time("t", duration=float(t[k]))
            recording.log(lane.entity, rr.StateChange(state=lane.states[k]))
        recording.reset_time()


def log_events(recording: rr.RecordingStream, move: Move, shown: Sequence[Lane]) -> None:
    """Log an entry where a limit is met, and where the longest and farthest stops would begin."""
    t, (limits,) = move.trajectory.t, [lane.states for lane in shown if lane.entity == _LIMIT]
    for k in _changes(limits):
        if limits[k] != _NO_LIMIT:
            _log_entry(recording, float(t[k]), f"{limits[k]} reaches its limit", SKY_BLUE)
    stop = move.stop
    if stop is not None:
        _log_entry(recording, stop.time_at_s, f"the longest stop would begin: {stop.time_s:.2f} s", ORANGE)
        _log_entry(recording, stop.distance_at_s, f"the farthest stop would begin: {stop.distance_m:.2f} m of the tip", ORANGE)
    recording.reset_time()


def states_view() -> rrb.StateTimelineView:
    """Return the view of the lanes."""
    return rrb.StateTimelineView(origin="/states", name="Phase, active limit, brakes")


def events_view() -> rrb.TextLogView:
    """Return the view of the entries."""
    columns = rrb.TextLogColumns(
        timeline_columns=[encodings.TimelineColumn("t", visible=False)],  # it is too narrow for a time
        text_log_columns=[encodings.TextLogColumn(encodings.TextLogColumnKind.Body)],
    )
    return rrb.TextLogView(origin="/events", name="Where limits are met", columns=columns)


def _at_rest(move: Move) -> Array:
    still: Array = (move.trajectory.qd == 0.0).all(axis=-1)
    return still


def _changes(states: Sequence[str]) -> list[int]:
    return [k for k, state in enumerate(states) if k == 0 or state != states[k - 1]]


def _log_entry(recording: rr.RecordingStream, at: float, text: str, color: Color) -> None:
    recording.set_time("t", duration=at)
    recording.log("events", rr.TextLog(f"{at:.2f} s: {text}", level=rr.TextLogLevel.INFO, color=color))
