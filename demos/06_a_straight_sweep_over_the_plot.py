"""The tip sweeps 2 m straight over a plot, the sensors facing down.

    python3 demos/06_a_straight_sweep_over_the_plot.py [OUT.rrd]

Learn: the tip keeps its line to a hundredth of a millimetre; what the sweep costs depends on the
constraint; a line that leaves the workspace says where.
"""

import sys

from boom_model import Boom, InfeasibleError
from planner import TipTarget, plan
from planner.recording import write_recording

START, GOAL = TipTarget((1.0, 1.7, 0.9)), TipTarget((-1.0, 1.7, 0.9))


def main(out: str = "sweep.rrd") -> None:
    boom = Boom.load()
    for constraint in ("horizontal", "least-extension", "least-torque"):
        move = plan(boom, START, GOAL, along="line", constraint=constraint, profile="jerk-limited")
        peaks = ", ".join(f"{peak.joint} {peak.total:.0f} {peak.unit}" for peak in move.report.peaks[:3])
        print(f"constraint {constraint}: {move.report.duration:.2f} s, {move.report.notes[0]}; largest torques {peaks}")
    write_recording(out, move)
    print(f"recording: {out}")
    try:
        plan(boom, START, TipTarget((-1.0, 2.6, 0.9)), along="line")
    except InfeasibleError as error:
        print(f"too far: {error}")


if __name__ == "__main__":
    main(*sys.argv[1:])
