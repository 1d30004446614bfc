"""Model of the boom: geometry, bodies, limits, drives, kinematics and dynamics.

The package knows no time profiles and no pictures. The only files that it reads are TOML files of
the boom and of the catalogue.
"""

from boom_model.boom import JOINTS, Body, Boom, Friction, Geometry, Limits, Mount
from boom_model.drives.catalogue import Catalogue
from boom_model.drives.drive import Drive, Gearbox, Motor, Winding, Wiring, mesh_efficiency
from boom_model.drives.gear_compliance import TipDeflection, gear_frequencies, tip_deflection
from boom_model.drives.linear_actuator import LinearActuator, LinearDrive, screw_torque
from boom_model.drives.wind_up import wind_up
from boom_model.dynamics.base_motion import BaseMotion, up_on_slope
from boom_model.dynamics.equations_of_motion import (
    forward_dynamics,
    gravity_torque,
    kinetic_energy,
    mass_matrix,
    potential_energy,
    velocity_torque,
)
from boom_model.dynamics.newton_euler import Loads, PinForces, inner_link_load, inverse_dynamics
from boom_model.dynamics.torque_breakdown import Breakdown, breakdown
from boom_model.errors import BoomError, InfeasibleError, InputError
from boom_model.kinematics.constraints import (
    ActuatorAngle,
    ActuatorHorizontal,
    ChoosingConstraint,
    Constraint,
    FixedExtension,
    FixingConstraint,
    LargestMargin,
    LeastExtension,
    LeastTime,
    LeastTorque,
    NearestHorizontal,
    NearestPose,
)
from boom_model.kinematics.forward import (
    BodyMotion,
    FrameMotion,
    TipPose,
    body_motion,
    forward_kinematics,
    frame_motion,
    jacobian,
    jacobian_rate,
    manipulability,
    transmission_angle,
)
from boom_model.kinematics.frames import body_transforms, dh_rows, frame_transforms
from boom_model.kinematics.inverse import (
    Branches,
    Solution,
    Solutions,
    inverse_kinematics,
    inverse_kinematics_of_pose,
    solve_branches,
)
from boom_model.kinematics.reach import NearestReachable, ReachMap, nearest_reachable, reach_map
from boom_model.provenance import Basis, Origin, Sourced
from boom_model.tip_uncertainty import tip_covariance, tip_deviation

__all__ = [
    "JOINTS",
    "ActuatorAngle",
    "ActuatorHorizontal",
    "BaseMotion",
    "Basis",
    "Body",
    "BodyMotion",
    "Boom",
    "BoomError",
    "Branches",
    "Breakdown",
    "Catalogue",
    "ChoosingConstraint",
    "Constraint",
    "Drive",
    "FixedExtension",
    "FixingConstraint",
    "FrameMotion",
    "Friction",
    "Gearbox",
    "Geometry",
    "InfeasibleError",
    "InputError",
    "LargestMargin",
    "LeastExtension",
    "LeastTime",
    "LeastTorque",
    "Limits",
    "LinearActuator",
    "LinearDrive",
    "Loads",
    "Motor",
    "Mount",
    "NearestHorizontal",
    "NearestPose",
    "NearestReachable",
    "Origin",
    "PinForces",
    "ReachMap",
    "Solution",
    "Solutions",
    "Sourced",
    "TipDeflection",
    "TipPose",
    "Winding",
    "Wiring",
    "body_motion",
    "body_transforms",
    "breakdown",
    "dh_rows",
    "forward_dynamics",
    "forward_kinematics",
    "frame_motion",
    "frame_transforms",
    "gear_frequencies",
    "gravity_torque",
    "inner_link_load",
    "inverse_dynamics",
    "inverse_kinematics",
    "inverse_kinematics_of_pose",
    "jacobian",
    "jacobian_rate",
    "kinetic_energy",
    "manipulability",
    "mass_matrix",
    "mesh_efficiency",
    "nearest_reachable",
    "potential_energy",
    "reach_map",
    "screw_torque",
    "solve_branches",
    "tip_covariance",
    "tip_deflection",
    "tip_deviation",
    "transmission_angle",
    "up_on_slope",
    "velocity_torque",
    "wind_up",
]
