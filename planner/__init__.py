"""Planning and checking of moves; reports, recordings and files of the results.

`planner` exports the names that a notebook starts with. The others are in its subpackages, for
example `planner.checks.certificate`. A name is imported when it is first used. The command imports
this package before it can handle a signal, so even importing `typing` here would take too long.
"""

TYPE_CHECKING = False  # as in `typing`; a type checker takes it for True
if TYPE_CHECKING:
    from planner.checks.rows import Verdict as Verdict
    from planner.experiments.comparison import compare as compare
    from planner.links.design import design_link as design_link
    from planner.links.task import LinkTask as LinkTask
    from planner.missions.mission import check_cycle as check_cycle
    from planner.missions.mission import load_mission as load_mission
    from planner.missions.mission import plan_cycle as plan_cycle
    from planner.motion.motion_files import read_motion as read_motion
    from planner.motion.motion_files import write_motion as write_motion
    from planner.motion.trajectory import Trajectory as Trajectory
    from planner.move_spec import MoveSpec as MoveSpec
    from planner.paths.targets import TipTarget as TipTarget
    from planner.planning import Move as Move
    from planner.planning import check as check
    from planner.planning import plan as plan
    from planner.planning import plan_motion as plan_motion
    from planner.reports.report import Report as Report
    from planner.sizing.choice import size as size
    from planner.timing.profile import Cubic as Cubic
    from planner.timing.profile import JerkLimited as JerkLimited
    from planner.timing.profile import LeastEnergy as LeastEnergy
    from planner.timing.profile import Quintic as Quintic
    from planner.timing.profile import TimeOptimal as TimeOptimal
    from planner.timing.profile import Trapezoidal as Trapezoidal

_HOMES = {
    "planner.checks.rows": ("Verdict",),
    "planner.experiments.comparison": ("compare",),
    "planner.links.design": ("design_link",),
    "planner.links.task": ("LinkTask",),
    "planner.missions.mission": ("check_cycle", "load_mission", "plan_cycle"),
    "planner.motion.motion_files": ("read_motion", "write_motion"),
    "planner.motion.trajectory": ("Trajectory",),
    "planner.move_spec": ("MoveSpec",),
    "planner.paths.targets": ("TipTarget",),
    "planner.planning": ("Move", "check", "plan", "plan_motion"),
    "planner.reports.report": ("Report",),
    "planner.sizing.choice": ("size",),
    "planner.timing.profile": ("Cubic", "JerkLimited", "LeastEnergy", "Quintic", "TimeOptimal", "Trapezoidal"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    from importlib import import_module, metadata

    if name == "__version__":
        return metadata.version("boom")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
