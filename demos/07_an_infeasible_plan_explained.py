"""Thirty kilograms on a boom made for ten: what fails, where, and possible fixes.

    python3 demos/07_an_infeasible_plan_explained.py

Learn: an infeasible plan names the joint, the limit and the place, splits the demand into its
parts, and offers the smallest single changes that work; each has been planned again before it is
offered.
"""

from boom_model import Boom, InfeasibleError
from planner import MoveSpec
from planner.planning import plan_move
from planner.suggestions import suggestions


def main() -> None:
    heavy = Boom.load().with_payload(30.0)
    for options in ({"profile": "time-optimal"}, {"duration": 3.0}):
        boom = heavy if "profile" in options else Boom.load()
        move = MoveSpec.of("transport", "phenotyping", **options)
        try:
            plan_move(boom, move)
        except InfeasibleError as error:
            print(error)
        for suggestion in suggestions(boom, move):
            print(f"  possible fix: {suggestion.sentence}")


if __name__ == "__main__":
    main()
