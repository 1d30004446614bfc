"""The thesis's question: with a lighter link or payload, would a lighter motor do?

    python3 demos/08_would_a_lighter_motor_do.py [OUT.png]

The picture shows the drives that the boom has, on the same day in the field.
"""

import sys

from boom_model import Boom, Catalogue
from planner import check_cycle, load_mission, plan_cycle
from planner.planning import torques
from planner.reports.drive_pictures import write_drive_picture
from planner.sizing.choice import choose, parse_variant


def main(out: str = "drives.png") -> None:
    boom = Boom.load()
    booms = {"as it is": boom} | {text: parse_variant(boom, text) for text in ("inner=5.55", "payload=5")}
    day = plan_cycle(boom, load_mission("field-day"))
    for choice in choose(booms, day, ("inner", "lower"), Catalogue.load()):
        best = choice.lightest
        if best is None or choice.saves is None:
            print(f"{choice.variant}, {choice.joint}: every motor fails")
            continue
        tightest = best.tightest("motor")
        margin = "-" if tightest is None or tightest.margin is None else f"{tightest.margin:.0%}"
        found = f"{best.name} does not fail, {margin} of torque to spare, and saves {choice.saves:.1f} kg"
        print(f"{choice.variant}, {choice.joint}: {found}")
        print(f"  without data: {', '.join(best.unknown)}; warnings: {', '.join(best.warned) or 'nothing'}")
        for failed in (judged for judged in choice.judged if judged.fails and judged.mass and judged.mass < (best.mass or 0.0)):
            row = failed.first_failing
            print(f"  lighter, but fails: {failed.name}, {failed.supply}: {'no motion' if row is None else row.check}")
    report = check_cycle(boom, day)
    moves = [samples for leg, samples in day.slices() if leg.moves]
    write_drive_picture(out, boom, day.trajectory, torques(boom, day.trajectory), report, moves)
    print(f"picture: {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])
