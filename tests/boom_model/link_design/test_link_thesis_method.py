"""The thesis's two-stage search against Appendix D, followed line by line."""

import numpy as np
import pytest

from boom_model.errors import InfeasibleError, InputError
from boom_model.link_design import THESIS_LOAD, Beam, Material, thesis_design

STEEL = Material.load("steel")
LIMITS = {"stress_limit": 175e6, "deflection_limit": 0.01}


def appendix_d(n: int, step: float, length=1.0, w=0.01, limit=175e6, most=0.01):
    """Heights (n + 1,) of both stages from A to B, and the mass of each, with every slice and every
    candidate recomputed."""
    dx, rho, E = length / n, STEEL.density, STEEL.elastic_modulus
    fx, fy = THESIS_LOAD.applied
    a0, rate, spin = THESIS_LOAD.acceleration, THESIS_LOAD.angular_velocity, THESIS_LOAD.angular_acceleration

    def stress(H, N, V, M):
        return np.sqrt((abs(N) / (H * w) + abs(M) * H / 2 / (w * H**3 / 12)) ** 2 + 3 * (V / (H * w)) ** 2)

    H = step
    while stress(H, fx, fy, 0.0) >= limit:
        H += step
    heights, moments, slices = [H], [0.0], []
    for i in range(1, n + 1):
        H = step
        while True:
            H_all = np.array([*slices, H])
            x = (np.arange(1, i + 1) - 0.5) * dx
            m = dx * w * rho * H_all
            mass, com = m.sum(), (m @ x) / m.sum()
            apart = (x - com) ** 2
            inertia = np.diag(
                [
                    (m / 12 * (H_all**2 + w**2)).sum(),
                    (m / 12 * (dx**2 + w**2) + m * apart).sum(),
                    (m / 12 * (dx**2 + H_all**2) + m * apart).sum(),
                ]
            )
            arm = np.array([length - com, 0.0, 0.0])
            F = -mass * (np.cross(spin, arm) + np.cross(rate, np.cross(rate, arm)) + a0)
            N = -(inertia @ spin + np.cross(rate, inertia @ rate))
            f = -(-np.array([fx, fy, 0.0]) + F)
            M = -(N + np.cross([com, 0.0, 0.0], F) + np.cross([i * dx, 0.0, 0.0], f))[2]
            if stress(H, f[0], f[1], M) < limit:
                break
            H += step
        slices.append(H)
        heights.append(H)
        moments.append(M)
    first, M = np.array(heights[::-1]), np.array(moments[::-1])
    second, steps, arms = first.copy(), 0, length - np.arange(n) * dx

    def deflection(H):
        curvature = M / (E * w * H**3 / 12)
        return np.abs(np.tan((curvature[:-1] + curvature[1:]) / 2 * dx) * arms).sum()

    while deflection(second) > most:
        gains = [deflection(second) - deflection(second + step * np.eye(n + 1)[i]) for i in range(n + 1)]
        second[int(np.argmax(gains))] += step
        steps += 1
    return first, second, rho * w * dx * first[:-1].sum(), steps


@pytest.mark.parametrize(("n", "step"), [(10, 1e-3), (24, 5e-4)])
def test_both_stages_give_appendix_d_contour(n, step):
    first, second, mass, steps = appendix_d(n, step)
    found = thesis_design(Beam(1.0, 0.01, STEEL, slices=n), THESIS_LOAD, **LIMITS, step=step)
    np.testing.assert_allclose(found.stress_heights, first, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.heights, second, rtol=0, atol=1e-12)
    assert found.stress_mass == pytest.approx(mass, rel=1e-12)
    assert found.steps == steps


def test_the_search_stops_at_the_first_step_within_the_deflection():
    found = thesis_design(Beam(1.0, 0.01, STEEL, slices=200), THESIS_LOAD, **LIMITS)
    assert found.deflection <= 0.01
    undone = found.coefficients * ((found.heights - 1e-4) ** -3.0 - found.heights**-3.0)
    raised = found.heights > found.stress_heights
    assert found.deflection + undone[raised].min() > 0.01
    wide = thesis_design(Beam(1.0, 0.01, STEEL, slices=200), THESIS_LOAD, stress_limit=175e6, deflection_limit=0.1)
    np.testing.assert_array_equal(wide.heights, wide.stress_heights)


def test_what_it_cannot_do_is_refused():
    beam = Beam(1.0, 0.01, STEEL, slices=50)
    with pytest.raises(InputError, match="deflection limit is 0; it must be finite and above 0"):
        thesis_design(beam, THESIS_LOAD, stress_limit=175e6, deflection_limit=0.0)
    with pytest.raises(InputError, match="step is nan"):
        thesis_design(beam, THESIS_LOAD, **LIMITS, step=float("nan"))
    with pytest.raises(InputError, match="a strut between two pins"):
        thesis_design(Beam(1.0, 0.01, STEEL, support="pinned"), THESIS_LOAD, **LIMITS)
    with pytest.raises(InfeasibleError, match=r"the stress limit needs a height of more than 0\.2 m"):
        thesis_design(beam, THESIS_LOAD, stress_limit=1e6, deflection_limit=0.01, step=1e-6)
    with pytest.raises(InputError, match=r"step is 1e-09 m; the stress limit needs more than 200000 steps"):
        thesis_design(beam, THESIS_LOAD, **LIMITS, step=1e-9)
