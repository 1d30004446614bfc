"""A measured move against its plan: what is error, what is delay, and what is noise.

    python3 demos/05_plan_and_reality.py [OUT.rrd]

No boom stands here, so the log is made up: the plan, 15 ms late, with 0.1 deg of play at the inner
joint, seeded noise of the encoders, and a clock that started 3.2 s earlier. It is left in log.csv,
the plan in plan.csv: the command does the same with `boom compare plan.csv log.csv --offset -3.2
--out both.rrd`.
"""

import sys

import numpy as np
import pyarrow as pa
from pyarrow import csv

from boom_model import JOINTS, Boom
from planner import compare, plan
from planner.experiments.comparison import read_log
from planner.motion.trajectory import read_csv, write_csv
from planner.planning import torques
from planner.recording import write_comparison_recording

DELAY, CLOCK, PLAY, NOISE = 0.015, 3.2, np.radians(0.1), 5e-5


def main(out: str = "both.rrd") -> None:
    boom = Boom.load()
    move = plan(boom, "transport", "phenotyping", profile="jerk-limited").trajectory
    write_csv(move, "plan.csv")
    t = np.arange(0.0, move.duration, 0.002)
    late = np.stack([np.interp(t - DELAY, move.t, q) for q in move.q.T], axis=-1)
    late[:, 1] -= PLAY
    measured = late + NOISE * np.random.default_rng(2024).normal(size=late.shape)
    columns = {"t": t + CLOCK} | {f"q{i + 1}": measured[:, i] for i in range(5)}
    csv.write_csv(pa.table(columns), "log.csv")

    log = read_log("log.csv")
    for what, offset in (("as the clocks say", -CLOCK), ("fitted", None)):
        found = compare(boom, move, log, offset=offset)
        tip = 1e3 * found.tip_error
        print(f"{what}, {found.offset:.4f} s: the tip is up to {tip.max():.1f} mm off, RMS {np.sqrt(np.mean(tip**2)):.1f} mm")
    print("the best fit takes the delay for a clock's difference, and some of the play too: know your clocks")

    found = compare(boom, move, log, offset=-CLOCK)
    spline = torques(boom, read_csv("log.csv"))[: len(found.planned.t)]
    for i, joint in enumerate(JOINTS):
        filtered, plain = (np.abs(tau - found.tau_planned)[found.inside, i].max() for tau in (found.tau_measured, spline))
        print(f"  {joint}: torque off by up to {filtered:.2f}, noise {found.torque_noise[i]:.2f}; a plain spline: {plain:.0f}")
    write_comparison_recording(out, found)
    print(f"recording: {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
