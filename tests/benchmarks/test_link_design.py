"""Time of a link's least mass, exact and by the thesis's two stages, on the thesis's load case with
1000 slices.

The peer of the exact method with own mass and shear is IPOPT on the same link as one nonlinear
program. That of the others is Appendix D's own search, which looks at every slice for every step:
102,453 of them. A hundred of its steps are timed here, vectorised, and multiplied. Run it alone for
the numbers: `pytest tests/benchmarks/test_link_design.py -s`.
"""

import time

import numpy as np
import pytest

from boom_model.link_design import THESIS_LOAD, Beam, Limits, Material, least_mass, thesis_design
from tests.boom_model.link_design.nonlinear_program import least_mass_by_ipopt

BEAM = Beam(1.0, 0.01, Material.load("steel"))
LIMITS = Limits(175e6, 0.01)
STEP, TIMED = 1e-4, 100
SHARE = {"thesis, fast": 1.0, "exact, frozen moments": 1.0, "exact, own mass and shear": 1.5}
"""Of the peer's time, at most"""


def appendix_d_stage_2(steps: int) -> float:
    """Seconds of that many steps of Appendix D's stage 2, all gains anew at each."""
    start = thesis_design(BEAM, THESIS_LOAD, stress_limit=175e6, deflection_limit=1.0, step=STEP)
    c, H = start.coefficients, start.stress_heights.copy()
    begun = time.perf_counter()
    for _ in range(steps):
        H[np.argmax(c / H**3 - c / (H + STEP) ** 3)] += STEP
        (c / H**3).sum()
    return time.perf_counter() - begun


def ipopt() -> float:
    """Seconds of the nonlinear program, the least of three."""
    taken = []
    for _ in range(3):
        begun = time.perf_counter()
        least_mass_by_ipopt(BEAM, THESIS_LOAD.cases, LIMITS)
        taken.append(time.perf_counter() - begun)
    return min(taken)


@pytest.mark.benchmark(group="least mass of a link, 1000 slices")
@pytest.mark.parametrize("method", SHARE)
def test_least_mass(benchmark, method):
    def run():
        if method == "thesis, fast":
            return thesis_design(BEAM, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.01, step=STEP)
        return least_mass(BEAM, THESIS_LOAD.cases, LIMITS, own_mass=method.endswith("shear"))

    found = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    assert found.mass == pytest.approx(3.726, abs=0.006)
    if benchmark.enabled:
        mine = benchmark.stats.stats.min
        theirs = ipopt() if method.endswith("shear") else appendix_d_stage_2(TIMED) * 102_453 / TIMED
        benchmark.extra_info |= {"seconds": mine, "of_the_peer": mine / theirs, "mass_kg": found.mass}
        print(f"\n{method}: {mine:.3f} s, {mine / theirs:.2g} of its peer's time")
        assert mine < SHARE[method] * theirs
