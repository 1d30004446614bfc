"""The boom itself: geometry, bodies, limits and drives, and its kinematics and dynamics. It knows nothing of time
profiles, screens or files, its own TOML aside."""

from boom_model.boom import JOINTS, Body, Boom, Geometry, Limits
from boom_model.catalogue import Catalogue
from boom_model.drives import Drive, Gearbox, Motor, Winding, Wiring
from boom_model.dynamics import Loads, PinForces, inverse_dynamics
from boom_model.errors import BoomError, InfeasibleError, InputError
from boom_model.frames import body_transforms, dh_rows, frame_transforms
from boom_model.inverse_kinematics import (
    ActuatorAngle,
    ActuatorHorizontal,
    Branches,
    FixedExtension,
    Solution,
    Solutions,
    inverse_kinematics,
    solve_branches,
)
from boom_model.kinematics import TipPose, forward_kinematics, jacobian
from boom_model.provenance import Basis, Origin, Sourced
from boom_model.reach import NearestReachable, nearest_reachable

__all__ = [
    "JOINTS",
    "ActuatorAngle",
    "ActuatorHorizontal",
    "Basis",
    "Body",
    "Boom",
    "BoomError",
    "Branches",
    "Catalogue",
    "Drive",
    "FixedExtension",
    "Gearbox",
    "Geometry",
    "InfeasibleError",
    "InputError",
    "Limits",
    "Loads",
    "Motor",
    "NearestReachable",
    "Origin",
    "PinForces",
    "Solution",
    "Solutions",
    "Sourced",
    "TipPose",
    "Winding",
    "Wiring",
    "body_transforms",
    "dh_rows",
    "forward_kinematics",
    "frame_transforms",
    "inverse_dynamics",
    "inverse_kinematics",
    "jacobian",
    "nearest_reachable",
    "solve_branches",
]
