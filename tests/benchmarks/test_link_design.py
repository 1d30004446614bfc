"""Time of a link's least mass, exact and by the thesis's two stages, on the thesis's load case with 1000 slices.

The peer of both is Appendix D's own search, which looks at every slice for every step: 102,453 of them. A hundred of its steps
are timed here, vectorised, and multiplied. Run it alone for the numbers: `pytest tests/benchmarks/test_link_design.py -s`.
"""

import time

import numpy as np
import pytest

from boom_model.link_design import THESIS_LOAD, Beam, Limits, Material, least_mass, thesis_design

BEAM = Beam(1.0, 0.01, Material.load("steel"))
STEP, TIMED = 1e-4, 100


def appendix_d_stage_2(steps: int) -> float:
    """Seconds of that many steps of Appendix D's stage 2, all gains anew at each."""
    start = thesis_design(BEAM, THESIS_LOAD, stress_limit=175e6, deflection_limit=1.0, step=STEP)
    c, H = start.coefficients, start.stress_heights.copy()
    begun = time.perf_counter()
    for _ in range(steps):
        H[np.argmax(c / H**3 - c / (H + STEP) ** 3)] += STEP
        (c / H**3).sum()
    return time.perf_counter() - begun


@pytest.mark.benchmark(group="least mass of a link, 1000 slices")
@pytest.mark.parametrize("method", ["thesis, fast", "exact, frozen moments", "exact, own mass and shear"])
def test_least_mass(benchmark, method):
    def run():
        if method == "thesis, fast":
            return thesis_design(BEAM, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.01, step=STEP)
        return least_mass(BEAM, THESIS_LOAD.cases, Limits(175e6, 0.01), own_mass=method.endswith("shear"))

    found = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    assert found.mass == pytest.approx(3.726, abs=0.006)
    if benchmark.enabled:
        mine = benchmark.stats.stats.min
        theirs = appendix_d_stage_2(TIMED) * 102_453 / TIMED
        benchmark.extra_info |= {"seconds": mine, "of_appendix_d_vectorised": theirs / mine, "mass_kg": found.mass}
        assert mine < theirs
