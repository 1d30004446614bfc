"""The boom opens while its tractor crosses ditches: what reaches mount and drives.

    python3 demos/01_vehicle_crossing_a_ditch.py [OUT.rrd]

Look at the recording with `boom view ditch.rrd`: the tab "Torque parts" shows the vehicle's share
of each torque, "Mount" the wrench on the mount.
"""

import sys

import numpy as np

from boom_model import Boom
from planner import plan
from planner.motion.vehicle import load_case
from planner.recording import write_recording


def main(out: str = "ditch.rrd") -> None:
    boom, ditch = Boom.load(), load_case("ditch")
    print(ditch.sentence)
    calm = plan(boom, "transport", "phenotyping", profile="jerk-limited")
    rough = plan(boom, "transport", "phenotyping", profile="jerk-limited", vehicle=ditch)
    for name, move in (("level ground", calm), ("ditches", rough)):
        size = np.linalg.norm(np.reshape(move.loads.mount, (-1, 2, 3)), axis=-1).max(axis=0)
        print(f"{name}: the mount bears up to {size[0]:.0f} N and {size[1]:.0f} Nm; {move.report.summary}")
    for peak in rough.report.peaks:
        print(
            f"  {peak.joint}: {peak.total:.1f} {peak.unit} at {peak.at_s:.2f} s, of which the vehicle adds {peak.vehicle:.1f}"
        )
    write_recording(out, rough)
    print(f"recording: {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
