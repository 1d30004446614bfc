"""From targets to motions that have been checked, and to what people keep of them: reports, recordings, CSV."""

from boom_model.kinematics.constraints import parse_constraint
from planner.checks.certificate import Certificate, WorstRatio, certify
from planner.checks.evaluation import Evaluation, evaluate
from planner.checks.kinds import CheckKind
from planner.checks.motion_checks import average_torque
from planner.checks.rows import Row, Verdict
from planner.checks.stopping import Stop, WorstStop, stop
from planner.experiments.comparison import Comparison, Log, compare, read_log
from planner.exports.robot_models import mjcf, urdf, write_model
from planner.links.design import LinkDesign, LinkTask, design_link
from planner.missions.mission import Cycle, Leg, Mission, check_cycle, load_mission, plan_cycle
from planner.motion.motion_files import read_motion, write_motion
from planner.motion.planned import PlannedMotion
from planner.motion.trajectory import Trajectory, read_csv, sample, write_csv
from planner.move_spec import MoveSpec
from planner.paths.path import JointLine, Path
from planner.paths.targets import TipTarget, parse_pitch, parse_target
from planner.planning import Move, check, examine, plan, plan_motion, plan_move, torques
from planner.reports.report import Report
from planner.sizing.choice import Adapt, Choice, Judged, candidates, choose, size
from planner.timing.path_limits import InfeasiblePathError
from planner.timing.profile import Cubic, JerkLimited, Profile, Quintic, TimeOptimal, Trapezoidal
from planner.timing.time_law import Motion, TimeLaw

__all__ = [
    "Adapt",
    "Certificate",
    "CheckKind",
    "Choice",
    "Comparison",
    "Cubic",
    "Cycle",
    "Evaluation",
    "InfeasiblePathError",
    "JerkLimited",
    "JointLine",
    "Judged",
    "Leg",
    "LinkDesign",
    "LinkTask",
    "Log",
    "Mission",
    "Motion",
    "Move",
    "MoveSpec",
    "Path",
    "PlannedMotion",
    "Profile",
    "Quintic",
    "Report",
    "Row",
    "Stop",
    "TimeLaw",
    "TimeOptimal",
    "TipTarget",
    "Trajectory",
    "Trapezoidal",
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
    "evaluate",
    "examine",
    "load_mission",
    "mjcf",
    "parse_constraint",
    "parse_pitch",
    "parse_target",
    "plan",
    "plan_cycle",
    "plan_motion",
    "plan_move",
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
