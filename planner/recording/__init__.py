"""Motions as Rerun files: the moving linkage beside its instruments. The only package that knows Rerun.

Every recording's timeline is "t", in seconds from the motion's start. What each holds stands at the function that writes it.
The linkage comes solved: each body's frame is a child of the mount, because a frame has one parent and a closed loop cannot
be shown. The solids' lengths are the model's, their thickness is for the eye only. Colours are Okabe and Ito's.
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
