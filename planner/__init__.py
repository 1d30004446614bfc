"""From targets to motions that have been checked, and to what people keep of them: reports, recordings, CSV."""

from planner.checks import Row, Verdict, average_torque
from planner.constraints import InfeasiblePathError
from planner.links import LinkDesign, LinkTask, design_link
from planner.path import JointLine, Path
from planner.planning import Move, Profile, check, plan
from planner.report import Report
from planner.targets import TipTarget, parse_hold, parse_pitch, parse_target
from planner.time_law import Motion, TimeLaw
from planner.trajectory import Trajectory, read_csv, sample, write_csv

__all__ = [
    "InfeasiblePathError",
    "JointLine",
    "LinkDesign",
    "LinkTask",
    "Motion",
    "Move",
    "Path",
    "Profile",
    "Report",
    "Row",
    "TimeLaw",
    "TipTarget",
    "Trajectory",
    "Verdict",
    "average_torque",
    "check",
    "design_link",
    "parse_hold",
    "parse_pitch",
    "parse_target",
    "plan",
    "read_csv",
    "sample",
    "write_csv",
]
