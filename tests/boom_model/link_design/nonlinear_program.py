"""A link's least mass as one nonlinear program of heights and internal forces, by CasADi and IPOPT.

It shares nothing with the product's method: no frozen forces, prices or cones. It takes the
conventions of the beam: lumps at the stations, the trapezoid rule, deflection by moment area and
shear.
"""

import casadi as ca
import numpy as np

from boom_model.link_design import Beam, Limits, LoadCases, internal_forces
from boom_model.link_design.beam import SHEAR_FACTOR, body_acceleration, outboard_share

HEIGHT, FORCE, MOMENT = 0.05, 1e3, 1e3
"""Units of the variables [m, N, Nm]"""


def least_mass_by_ipopt(beam: Beam, case: LoadCases, limits: Limits) -> tuple[float, np.ndarray]:
    """Return mass [kg] and heights (n + 1,) of a cantilever whose one load case presses it together
    and down."""
    ((along, across),) = case.end_force
    own = beam.material.density * beam.width * beam.weights
    share, n = outboard_share(beam), beam.slices + 1
    h, axial, transverse, bending = (ca.MX.sym(name, n) for name in ("H", "N", "V", "M"))
    H, N, V, M = h * HEIGHT, axial * FORCE, transverse * FORCE, bending * MOMENT
    lumps = [own * a * H for a in body_acceleration(beam, case)[0]]

    def summed(F, lump, end):
        """From each station to the next by what lies between, up to the end's force."""
        between = (1.0 - share[1:]) * lump[1:] + share[:-1] * lump[:-1]
        return ca.vertcat(F[:-1] - F[1:] + between, F[-1] - end) / FORCE

    turned = M[:-1] - M[1:] - beam.step * (V + share * lumps[1])[:-1]
    bent = -N * H - 6.0 * M
    stress = (bent**2 + 3.0 * V**2 * H**2) / ((limits.stress * beam.width) ** 2 * H**4)
    E, G, w = beam.material.elastic_modulus, beam.material.shear_modulus, beam.width
    deflection = ca.sum1(-12.0 * beam.lever * beam.weights / (E * w) * M / H**3)
    deflection += ca.sum1(-beam.weights / (SHEAR_FACTOR * G * w) * V / H)
    equations = ca.vertcat(summed(N, lumps[0], along), summed(V, lumps[1], across), ca.vertcat(turned, M[-1]) / MOMENT)
    program = {
        "x": ca.vertcat(h, axial, transverse, bending),
        "f": ca.dot(own, H),
        "g": ca.vertcat(equations, stress, deflection / limits.deflection),
    }
    solver = ca.nlpsol("link", "ipopt", program, {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"})
    level = np.full(n, 1.4 * HEIGHT)
    forces = internal_forces(beam, level, case)
    found = solver(
        x0=np.concatenate([level / HEIGHT, forces.N[0] / FORCE, forces.V[0] / FORCE, forces.M[0] / MOMENT]),
        lbx=np.concatenate([np.full(n, 1e-3), np.full(3 * n, -np.inf)]),
        lbg=np.concatenate([np.zeros(3 * n), np.full(n + 1, -np.inf)]),
        ubg=np.concatenate([np.zeros(3 * n), np.ones(n + 1)]),
    )
    assert solver.stats()["success"]
    return float(found["f"]), np.asarray(found["x"]).ravel()[:n] * HEIGHT
