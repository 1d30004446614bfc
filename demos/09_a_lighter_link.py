"""The inner link made as light as its loads allow, and what that does to the drive that lifts it.

    python3 demos/09_a_lighter_link.py [OUT.rrd]

Learn: the thesis's load case asks for far more link than its own dynamics does; the least mass
comes with a bound that no link goes below; and a lighter link saves torque, but no motor.
"""

import sys

from boom_model import Boom
from planner import LinkTask, design_link
from planner.links.design import default_moves
from planner.recording import write_link_recording


def main(out: str = "link.rrd") -> None:
    boom = Boom.load()
    for load, method in (("thesis", "thesis"), ("thesis", "exact"), ("moves", "exact")):
        task = LinkTask(load=load, method=method)
        design = design_link(boom, task, default_moves(boom, task))
        bound = None if design.exact is None else design.exact.lower_bound
        proven = "" if bound is None else f" (none below {bound:.3f} kg)"
        before, after = (abs(torque).max() for torque in design.torques)
        print(f"load of {load}, {method} method: plates {design.mass:.3f} kg{proven}")
        print(f"  joint inner bears {before:.1f} Nm with the old link, {after:.1f} Nm with this one")
        for choice in design.motors:
            print(f"  {choice.motor}: {choice.before} before, {choice.after} now")
    write_link_recording(out, design)
    print(f"recording: {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
