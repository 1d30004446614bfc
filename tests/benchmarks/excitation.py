"""Condition number of the designed motion, of random feasible ones and of table 2-4's cubic.

Run it by hand: `python -m tests.benchmarks.excitation [COUNT]`. 1,000 random motions take some six
minutes of one core.
"""

import sys

import numpy as np

from boom_model import Boom, inverse_dynamics
from planner import plan
from planner.experiments.excitation import PERIOD, Excitation, condition_number, design, log_information, random_excitation
from planner.timing.limit_ratios import limit_ratios

POINTS = np.linspace(0.0, PERIOD, 400, endpoint=False)
FINE = np.linspace(0.0, PERIOD, 40_001)
"""Ten times finer than the grid on which the motions were made to fit."""


def main(count: int) -> None:
    """Print the figures."""
    boom, rng = Boom.load().with_payload(0.0), np.random.default_rng(18)
    designed = design(boom)
    print(
        f"designed: {condition_number(boom, designed(POINTS)):.0f}, information {log_information(boom, designed(POINTS)):.0f}"
    )
    print(f"largest ratio to a limit at {len(FINE)} points: {worst(boom, designed):.4f}")
    cubic = plan(boom, "transport", "phenotyping", duration=10.0).trajectory
    print(f"cubic of table 2-4: {condition_number(boom, (cubic.q, cubic.qd, cubic.qdd)):.3g}")
    found, ratios = [], []
    for _ in range(count):
        motion = random_excitation(boom, rng)
        found.append(condition_number(boom, motion(POINTS)))
        ratios.append(worst(boom, motion))
    least, low, middle = np.quantile(found, [0.0, 0.1, 0.5], method="lower")
    print(f"{count} random motions: least {least:.3g}, a tenth below {low:.3g}, half below {middle:.3g}")
    print(f"largest ratio of any of them: {max(ratios):.4f}")


def worst(boom: Boom, motion: Excitation) -> float:
    """Largest ratio to a limit of joints and drives on the fine grid."""
    q, qd, qdd = motion(FINE)
    tau = inverse_dynamics(boom, q, qd, qdd, friction=True, reactions=False).tau
    return max(float(ratio.max()) for ratio in limit_ratios(boom, q, qd, qdd, None, tau).values())


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
