"""Calibrate a machine: a simulated boom, made a little wrong, is measured and found out.

The true boom has lengths that are off by 2 to 3 mm and zeros that are off by half a degree. The
tracker stands anywhere and measures to 0.5 mm. One of its targets was knocked. The script writes
measured.csv and others.csv.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from boom_model import Boom, forward_kinematics, gravity_torque, wind_up
from planner.experiments.calibration import calibrate, rms
from planner.experiments.calibration_poses import suggest_poses
from planner.experiments.measurements import read_measurements

NOISE = 5e-4  # [m]
OFFSETS = np.array([0.0, np.radians(0.5), np.radians(-0.5), 0.002, np.radians(0.5)])

boom, rng = Boom.load(), np.random.default_rng(18)
lengths = {"L2": 0.032, "L4": 1.002, "L6": 0.04408, "L8": 0.038, "upper_less_lower": 0.002, "inner_less_outer": -0.003}
true_boom = replace(boom, geometry=replace(boom.geometry, **lengths))
R, t = Rotation.from_euler("xyz", [2.0, -1.0, 130.0], degrees=True).as_matrix(), np.array([3.0, 2.0, 0.4])


def measure(readings, name):
    """Write what the tracker sees of the true boom."""
    q = readings + OFFSETS
    for i, torque in enumerate(gravity_torque(true_boom, q).T):
        drive = boom.drives[i]
        angle = None if drive is None else wind_up(drive.gearbox, torque)
        if angle is not None:
            q[:, i] -= angle
    tips = forward_kinematics(true_boom, q).position @ R.T + t + NOISE * rng.normal(size=(len(q), 3))
    if name == "measured.csv":
        tips[7, 0] += 0.05  # a knocked target
    header = "q1,q2,q3,q4,q5,x,y,z"
    np.savetxt(name, np.column_stack([readings, tips]), delimiter=",", header=header, comments="")
    return name


poses = suggest_poses(boom, 30, tip_sd=NOISE).q
measured = read_measurements(measure(poses, "measured.csv"), NOISE)
others = read_measurements(measure(suggest_poses(boom, 20, tip_sd=NOISE, seed=1).q, "others.csv"), NOISE)

found = calibrate(boom, measured)
check = found.checked_on(others)
print(f"tips that were not used: {check.before * 1e3:.1f} mm off before, {check.after * 1e3:.2f} mm now")
print(f"the noise allows {check.expected * 1e3:.2f} mm; equal links would leave {found.equal_links_rms * 1e3:.2f} mm")
print(f"residuals {rms(found.residuals[found.used]) * 1e3:.2f} mm; poses left out: {np.flatnonzero(~found.used) + 1}")
