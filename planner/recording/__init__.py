"""Rerun recordings of motions: the moving linkage with its plots beside it.

This is the only package that imports Rerun. Every recording has the timeline "t", in seconds from
the start of the motion. The docstring of each `write_...` function lists the entities that it
writes.

The poses of the linkage are solved before they are logged. The frame of every body is a child of
the mount, because a Rerun frame has one parent and so cannot represent a closed loop. The solids
have the lengths of the model; their thickness is for display only. The colours are Okabe and Ito's.
"""

from planner.recording.comparison import write_comparison_recording
from planner.recording.control import write_control_recording
from planner.recording.link import write_link_recording
from planner.recording.move import write_recording
from planner.recording.moves import write_moves_recording
from planner.recording.reach import write_reach_recording

__all__ = [
    "write_comparison_recording",
    "write_control_recording",
    "write_link_recording",
    "write_moves_recording",
    "write_reach_recording",
    "write_recording",
]
