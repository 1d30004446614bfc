"""Virtual experiments in MuJoCo: held-out error, intervals, and whether the bodies are possible.

Run it by hand: `python -m tests.benchmarks.experiments [FIRST LAST [SECONDS]]`, for the seeds FIRST
to LAST - 1. Each is a boom with other masses and friction that moves for SECONDS (30) at 1 kHz. It
is fitted to all of that, to a second and to a tenth of one.
"""

import sys
import time

import numpy as np
from scipy.stats import chi2

from boom_model import Boom
from planner.experiments.comparison import Log
from planner.experiments.identification import Identification, identify
from planner.experiments.readings import readings_of
from tests.builders import without_drives
from tests.virtual_boom import TORQUE_NOISE, experiment, fourier, perturbed, true_parameters

SHORT = (0.1, 1.0)


def part(log: Log, duration: float) -> Log:
    """The part of the log in which the joint that moves least moves most."""
    count = round(duration / (log.t[1] - log.t[0]))
    starts = range(0, len(log.t) - count, 250)
    first = max(starts, key=lambda k: float(np.ptp(log.q[k : k + count], axis=0).min()))
    some = slice(first, first + count)
    assert log.tau is not None
    return Log.of(log.t[some], log.q[some], tau=log.tau[some])


def least_eigenvalue(found: Identification) -> float:
    """Of the bodies' pseudo-inertias, relative to each one's largest."""
    values = np.linalg.eigvalsh(found.pseudo_inertias)
    return float((values[:, 0] / values[:, -1]).min())


def main(first: int, last: int, duration: int) -> None:
    """Print a line a seed, and the sums."""
    boom = without_drives(Boom.load()).with_payload(0.0)
    within, chi, count, held, least, inside = 0, 0.0, 0, 0.0, np.inf, 0
    for seed in range(first, last):
        rng, begun = np.random.default_rng(1000 + seed), time.process_time()
        truth = perturbed(boom, rng)
        log = experiment(boom, truth, fourier(boom, rng), duration, rng).log
        simulated = time.process_time()
        found = identify(boom, [readings_of(log)], drive_inertia=True)
        taken, base = time.process_time() - simulated, found.base
        assert base is not None
        error = base.values - base.combinations @ true_parameters(truth)
        z = np.abs(error / base.deviations)
        square = float(error @ np.linalg.solve(base.covariance, error))
        worst = max(joint.after for joint in found.joints) / TORQUE_NOISE
        short = [identify(boom, [readings_of(part(log, each))], drive_inertia=True) for each in SHORT]
        lowest = [least_eigenvalue(each) for each in (*short, found)]
        least = min(least, *lowest)
        within, chi, count = within + int((z < 3.0).sum()), chi + square, count + len(z)
        inside += int(square < chi2.ppf(0.9973, len(z)))
        held = max(held, worst)
        print(
            f"seed {seed}: held-out RMS at most {worst:.3f} of the noise; {int((z < 3.0).sum())} of {len(z)} within 3 sigma, "
            f"largest {z.max():.2f}; chi-square {square:.1f}; least eigenvalues {', '.join(f'{x:.1e}' for x in lowest)}; "
            f"fit {taken:.1f} s, simulation {simulated - begun:.1f} s",
            flush=True,
        )
    print(f"held-out RMS at most {held:.3f} of the noise; {within} of {count} base parameters within 3 sigma")
    print(
        f"chi-square {chi:.0f} of {count}; all base parameters of {inside} of {last - first} experiments within 3 sigma as one"
    )
    print(f"least eigenvalue of any pseudo-inertia: {least:.2g} of its largest")


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    main(*given, *(0, 10, 30)[len(given) :])
