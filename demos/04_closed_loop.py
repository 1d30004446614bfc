"""The same move with three controllers: how far the tip is off, and what shakes at the end.

    python3 demos/04_closed_loop.py [OUT.rrd]

Look at the recording with `boom view closed_loop.rrd`: the tab "Tip error" holds the cases side by
side, a tab a case its joints: commanded and actual position, error, and the torque beside what the
motor has.
"""

import sys

from boom_model import Boom
from planner import plan
from planner.control import Controller, Setup, Shaper, study
from planner.recording import write_control_recording

CONTROLLERS = [Controller.PID, Controller.COMPUTED_TORQUE, Controller.STEPPER]


def main(out: str = "closed_loop.rrd") -> None:
    boom = Boom.load()
    move = plan(boom, "transport", "phenotyping", profile="time-optimal")
    found = study(boom, [move], CONTROLLERS, [Shaper.NONE, Shaper.ZV], Setup(compensate_sag=True))
    print(found.modes_sentence)
    for row in found.rows:
        peak, shakes = 1e3 * row.tip_error_peak_m, 1e3 * row.residual_vibration_m
        print(f"{row.controller}, shaper {row.shaper}: {row.duration_s:.2f} s, {row.outcome}")
        print(f"  the tip is off by up to {peak:.2f} mm, and shakes by {shakes:.2f} mm at the end")
    for design in found.designs:
        least = min(design.loop.margins, key=lambda m: m.phase_deg)
        print(f"{design.controller}: least phase margin {least.phase_deg:.0f} deg, at {least.crossover_Hz:.1f} Hz")
    write_control_recording(out, found)
    print(f"recording: {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
