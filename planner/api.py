"""The public names of `planner`, which are imported when the first of them is used."""

from planner.checks.certificate import Certificate, WorstRatio, certify
from planner.checks.motion_checks import average_torque
from planner.checks.rows import Row, Verdict
from planner.checks.stopping import Stop, WorstStop, stop
from planner.experiments.comparison import Comparison, Log, compare, read_log
from planner.exports.robot_models import mjcf, urdf, write_model
from planner.links.design import LinkDesign, LinkTask, design_link
from planner.missions.mission import Cycle, Leg, Mission, check_cycle, load_mission, plan_cycle
from planner.motion.motion_files import read_motion, write_motion
from planner.motion.trajectory import Trajectory, read_csv, sample, write_csv
from planner.paths.path import JointLine, Path
from planner.paths.targets import TipTarget, parse_hold, parse_pitch, parse_target
from planner.planning import Move, check, examine, plan, torques
from planner.reports.report import Report
from planner.sizing.choice import Adapt, Choice, Judged, candidates, choose, size
from planner.timing.path_limits import InfeasiblePathError
from planner.timing.time_law import Motion, TimeLaw
from planner.timing.timing import Profile

__all__ = [
    "Adapt",
    "Certificate",
    "Choice",
    "Comparison",
    "Cycle",
    "InfeasiblePathError",
    "JointLine",
    "Judged",
    "Leg",
    "LinkDesign",
    "LinkTask",
    "Log",
    "Mission",
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
    "candidates",
    "certify",
    "check",
    "check_cycle",
    "choose",
    "compare",
    "design_link",
    "examine",
    "load_mission",
    "mjcf",
    "parse_hold",
    "parse_pitch",
    "parse_target",
    "plan",
    "plan_cycle",
    "read_csv",
    "read_log",
    "read_motion",
    "sample",
    "size",
    "stop",
    "torques",
    "urdf",
    "write_csv",
    "write_model",
    "write_motion",
]
