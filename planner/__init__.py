"""From targets to motions that have been checked, and to what people keep of them: reports, recordings, CSV."""

from planner.certificate import Certificate, WorstRatio, certify
from planner.checks import Row, Verdict, average_torque
from planner.constraints import InfeasiblePathError
from planner.path import JointLine, Path
from planner.planning import Move, check, plan
from planner.report import Report
from planner.stopping import Stop, WorstStop, stop
from planner.targets import TipTarget, parse_hold, parse_pitch, parse_target
from planner.time_law import Motion, TimeLaw
from planner.timing import Profile
from planner.trajectory import Trajectory, read_csv, sample, write_csv

__all__ = [
    "Certificate",
    "InfeasiblePathError",
    "JointLine",
    "Motion",
    "Move",
    "Path",
    "Profile",
    "Report",
    "Row",
    "Stop",
    "TimeLaw",
    "TipTarget",
    "Trajectory",
    "Verdict",
    "WorstRatio",
    "WorstStop",
    "average_torque",
    "certify",
    "check",
    "parse_hold",
    "parse_pitch",
    "parse_target",
    "plan",
    "read_csv",
    "sample",
    "stop",
    "write_csv",
]
