"""Rerun recordings of motions: the moving linkage with its plots beside it.

This is the only package that imports Rerun. Every recording has the timeline "t", in seconds from
the start of the motion. The docstring of each `write_...` function lists the entities that it
writes.

The poses of the linkage are solved before they are logged. The frame of every body is a child of
the mount, because a Rerun frame has one parent and so cannot represent a closed loop. The solids
have the lengths of the model; their thickness is for display only. The colours are Okabe and Ito's.

A name is imported when it is first used: the recording of a move needs neither link design nor the
closed loop, whose imports take longer than writing it.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.recording.before_after import write_before_after_recording as write_before_after_recording
    from planner.recording.comparison import write_comparison_recording as write_comparison_recording
    from planner.recording.control import write_control_recording as write_control_recording
    from planner.recording.link import write_link_recording as write_link_recording
    from planner.recording.move import write_recording as write_recording
    from planner.recording.moves import write_moves_recording as write_moves_recording
    from planner.recording.reach import write_reach_recording as write_reach_recording

_HOME = {
    "write_before_after_recording": "planner.recording.before_after",
    "write_comparison_recording": "planner.recording.comparison",
    "write_control_recording": "planner.recording.control",
    "write_link_recording": "planner.recording.link",
    "write_moves_recording": "planner.recording.moves",
    "write_reach_recording": "planner.recording.reach",
    "write_recording": "planner.recording.move",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
