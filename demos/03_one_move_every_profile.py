"""The main move with every profile, and with a payload that makes the drives decide.

    python3 demos/03_one_move_every_profile.py

Learn: under assumed joint limits alone the trapezoid is already the fastest; once the drives'
torque-speed curve decides, only the time-optimal profile knows where on the path there is torque to
spare, and an even slowing of the others costs a second.
"""

from boom_model import Boom
from planner import MoveSpec
from planner.profile_table import HEADER, cells, profile_table


def main() -> None:
    boom, move = Boom.load(), MoveSpec.of("transport", "phenotyping")
    for payload in (10.0, 20.0):
        print(f"transport to phenotyping with {payload:g} kg")
        rows = [HEADER, *(cells(row) for row in profile_table(boom.with_payload(payload), move))]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for row in rows:
            print("  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)))


if __name__ == "__main__":
    main()
