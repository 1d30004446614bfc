"""Masses and friction from a measured motion, and what the log can tell of them.

    python3 demos/11_identify_the_dynamics.py

No boom stands here, so the log is made up: a boom whose inner link is 8 % heavier and whose joints
rub, encoders with 0.01 deg of noise and torques with 1 Nm. It is left in excited.csv, and the
motion in excite.csv: `boom identify excited.csv --payload 0
--out measured.toml` does the same.
"""

from dataclasses import replace

import numpy as np
import pyarrow as pa
from pyarrow import csv

from boom_model import JOINTS, Boom, inverse_dynamics
from boom_model.arrays import read_only
from boom_model.boom import Friction
from planner.experiments.excitation import random_excitation
from planner.experiments.identification import identify
from planner.experiments.readings import read_torque_log, readings_of
from planner.motion.trajectory import write_csv


def main() -> None:
    boom = Boom.load().with_payload(0.0)
    friction = Friction(read_only([9, 14, 12, 40, 0.4]), read_only([8, 12, 10, 14, 0.8]), (None,) * 5)
    truth = replace(boom.with_body_mass("inner", 1.08 * boom.bodies["inner"].mass), friction=friction)
    rng = np.random.default_rng(2024)
    motion = random_excitation(boom, rng)
    write_csv(motion.trajectory, "excite.csv")
    t = np.arange(0.0, motion.period, 0.002)
    q, qd, qdd = motion(t)
    tau = inverse_dynamics(truth, q, qd, qdd, friction=True, reactions=False).tau
    noisy = q + np.radians(0.01) * rng.normal(size=q.shape), tau + rng.normal(size=q.shape)
    columns = {f"{name}{i + 1}": x[:, i] for name, x in zip(("q", "tau"), noisy, strict=True) for i in range(5)}
    csv.write_csv(pa.table({"t": t} | columns), "excited.csv")

    found = identify(boom, [readings_of(read_torque_log("excited.csv"))])
    print(f"a random motion of 20 s determines {found.told} of {found.countable} combinations better than the boom's file")
    for i, (joint, fit) in enumerate(zip(JOINTS, found.joints, strict=True)):
        dry, true = found.boom.friction.coulomb[i], friction.coulomb[i]
        print(f"  {joint}: not explained {fit.before:.2f}, now {fit.after:.2f} {fit.unit}; dry friction {dry:.2f} of {true:g}")
    print("boom identify --design writes a motion that determines more")


if __name__ == "__main__":
    main()
