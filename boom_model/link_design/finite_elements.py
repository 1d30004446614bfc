"""Finite elements that check a design: Euler-Bernoulli and Timoshenko beams, and a plate.

Elements and assembly are scikit-fem's, and only this module imports it. Of the design it uses the
heights, the load case and the material, but none of its formulas. The thesis's counterparts are
ANSYS beam 188 (figure 3-18) and hexahedra (figure 3-20).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from boom_model.arrays import Array
from boom_model.errors import InputError
from boom_model.link_design.beam import SHEAR_FACTOR, Beam, LoadCases

Theory = Literal["euler-bernoulli", "timoshenko"]


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of the finite elements for one load case."""

    deflection: float
    """Deflection of a cantilever's end or a strut's middle [m]"""
    x: Array
    """Positions of the stresses [m]"""
    stress: Array
    """Largest von Mises stress of the section at x [Pa]"""
    elements: int


def solve_beam(
    beam: Beam, H: Array, case: LoadCases, elements: int, theory: Theory = "euler-bernoulli", *, prismatic: bool = False
) -> Solution:
    """Solve the link as beam elements.

    Args:
        beam: the beam.
        H: (n + 1,) heights [m], linear between the stations.
        case: one load case of a link clamped at its root.
        elements: number of elements.
        theory: beam theory of the elements.
        prismatic: whether each element has the height of its middle along its whole length, as in
            the thesis's figure 3-18.
    """
    from scipy.sparse import bmat
    from skfem import (
        Basis,
        BilinearForm,
        ElementLineHermite,
        ElementLineP1,
        ElementLineP2,
        LinearForm,
        MeshLine,
        condense,
        solve,
    )

    _require_one(case)
    E, G, w = beam.material.elastic_modulus, beam.material.shear_modulus, beam.width
    mesh = MeshLine(np.linspace(0.0, beam.length, elements + 1))

    def height(x: Array) -> Array:
        at = (np.floor(np.clip(x / beam.length * elements, 0, elements - 1e-9)) + 0.5) * beam.length / elements
        return np.interp(at if prismatic else x, beam.stations, H)

    def across(x: Array) -> Array:
        return _body(beam, case, 1, x) * height(x)

    def along(x: Array) -> Array:
        return _body(beam, case, 0, x) * height(x)

    end = np.array([beam.length])
    order = 8
    points: Array
    bar = Basis(mesh, ElementLineP2(), intorder=order)
    stretch = BilinearForm(lambda u, v, p: E * w * height(p.x[0]) * u.grad[0] * v.grad[0]).assemble(bar)
    pull = LinearForm(lambda v, p: along(p.x[0]) * v).assemble(bar)
    pull[_at(bar, end)] += case.end_force[0, 0]
    u = solve(*condense(stretch, pull, D=_at(bar, np.zeros(1))))
    supports = np.zeros(1) if beam.support == "cantilever" else np.array([0.0, beam.length])
    watched = beam.length if beam.support == "cantilever" else beam.length / 2.0
    if theory == "euler-bernoulli":
        basis = Basis(mesh, ElementLineHermite(), intorder=order, disable_doflocs=True)
        bend = BilinearForm(lambda v, t, p: E * w * height(p.x[0]) ** 3 / 12.0 * v.hess[0, 0] * t.hess[0, 0]).assemble(basis)
        push = LinearForm(lambda t, p: across(p.x[0]) * t).assemble(basis)
        deflections, slopes = basis.nodal_dofs
        last = int(np.argmax(mesh.p[0]))
        push[deflections[last]] += case.end_force[0, 1]
        push[slopes[last]] += case.end_moment[0]
        fixed = [deflections[np.argmin(np.abs(mesh.p[0] - x))] for x in supports]
        if beam.support == "cantilever":
            fixed.append(slopes[np.argmin(mesh.p[0])])
        v = solve(*condense(bend, push, D=np.array(fixed)))
        deflection = float((basis.probes(np.array([[min(watched, beam.length * (1 - 1e-12))]])) @ v)[0])
        field = basis.interpolate(v)
        points = basis.global_coordinates()[0]
        moment = E * w * height(points) ** 3 / 12.0 * np.asarray(field.hess)[0, 0]
        shear = _shear(beam, case, H, points)
    else:
        lift, turn = Basis(mesh, ElementLineP2(), intorder=order), Basis(mesh, ElementLineP1(), intorder=order)
        stiff_in_shear = SHEAR_FACTOR * G * w
        K = bmat(
            [
                [
                    BilinearForm(lambda u, v, p: stiff_in_shear * height(p.x[0]) * u.grad[0] * v.grad[0]).assemble(lift),
                    BilinearForm(lambda r, v, p: -stiff_in_shear * height(p.x[0]) * r * v.grad[0]).assemble(turn, lift),
                ],
                [
                    BilinearForm(lambda u, s, p: -stiff_in_shear * height(p.x[0]) * u.grad[0] * s).assemble(lift, turn),
                    BilinearForm(
                        lambda r, s, p: (
                            E * w * height(p.x[0]) ** 3 / 12.0 * r.grad[0] * s.grad[0] + stiff_in_shear * height(p.x[0]) * r * s
                        )
                    ).assemble(turn),
                ],
            ],
            "csr",
        )
        push = np.concatenate([LinearForm(lambda v, p: across(p.x[0]) * v).assemble(lift), np.zeros(turn.N)])
        push[_at(lift, end)] += case.end_force[0, 1]
        push[lift.N + _at(turn, end)] += case.end_moment[0]
        fixed = list(_at(lift, supports))
        if beam.support == "cantilever":
            fixed += list(lift.N + _at(turn, np.zeros(1)))
        both = solve(*condense(K, push, D=np.array(fixed)))
        v, r = both[: lift.N], both[lift.N :]
        deflection = float((lift.probes(np.array([[min(watched, beam.length * (1 - 1e-12))]])) @ v)[0])
        points = lift.global_coordinates()[0]
        slope, rotation = np.asarray(lift.interpolate(v).grad)[0], turn.interpolate(r)
        moment = E * w * height(points) ** 3 / 12.0 * np.asarray(rotation.grad)[0]
        shear = stiff_in_shear * height(points) * (slope - np.asarray(rotation))
    normal = E * w * height(points) * np.asarray(bar.interpolate(u).grad)[0]
    area = w * height(points)
    stress = np.hypot(np.abs(normal) / area + 6.0 * np.abs(moment) / (area * height(points)), np.sqrt(3.0) * shear / area)
    order_of_x = np.argsort(points.ravel())
    return Solution(abs(deflection), points.ravel()[order_of_x], stress.ravel()[order_of_x], elements)


def solve_plate(beam: Beam, H: Array, case: LoadCases, along: int, across: int) -> Solution:
    """Solve the contour as a plate in plane stress.

    The elements are quadrilaterals of second degree. Their thickness is that of all plates
    together. A cantilever is clamped along its whole root. The load at its end is spread over the
    section: the force evenly, the moment linearly. Near both ends the stress differs from that of a
    beam.

    Args:
        beam: the beam.
        H: (n + 1,) heights [m], linear between the stations.
        case: one load case of a link clamped at its root.
        along: number of elements along the link.
        across: number of elements over its height.

    Raises:
        InputError: the beam is a strut between pins, which no edge of a plate can represent.
    """
    from skfem import (
        Basis,
        BilinearForm,
        ElementQuad2,
        ElementVector,
        FacetBasis,
        LinearForm,
        MeshQuad,
        condense,
        solve,
    )
    from skfem.helpers import ddot, sym_grad, trace

    _require_one(case)
    if beam.support != "cantilever":
        raise InputError("the plate model needs a link clamped at its root, not a strut")
    E, nu, w = beam.material.elastic_modulus, beam.material.poisson_ratio, beam.width
    square = MeshQuad.init_tensor(np.linspace(0.0, beam.length, along + 1), np.linspace(-0.5, 0.5, across + 1))
    x, y = square.p
    mesh = MeshQuad(np.stack([x, y * np.interp(x, beam.stations, H)]), square.t).with_boundaries(
        {"root": lambda x: x[0] < 1e-9, "end": lambda x: x[0] > beam.length - 1e-9}
    )
    element = ElementVector(ElementQuad2())
    basis = Basis(mesh, element, intorder=6)
    shear, first = E / (2.0 * (1.0 + nu)), E * nu / (1.0 - nu**2)

    def form(u, v, _):  # type: ignore[no-untyped-def]
        a, b = sym_grad(u), sym_grad(v)
        return w * (2.0 * shear * ddot(a, b) + first * trace(a) * trace(b))

    edge = FacetBasis(mesh, element, facets="end", intorder=6)
    h, (fx, fy), m = float(H[-1]), case.end_force[0], case.end_moment[0]
    load = LinearForm(lambda v, p: _body(beam, case, 0, p.x[0]) * v[0] + _body(beam, case, 1, p.x[0]) * v[1]).assemble(basis)
    load += LinearForm(lambda v, p: (fx / h - m * p.x[1] * 12.0 / h**3) * v[0] + fy / h * v[1]).assemble(edge)
    u = solve(*condense(BilinearForm(form).assemble(basis), load, D=basis.get_dofs("root")))
    ends = edge.interpolate(u)
    deflection = float((np.asarray(ends)[1] * edge.dx).sum() / edge.dx.sum())
    # Stress at the outer edges, where that of a beam is largest.
    outer = FacetBasis(mesh, element, facets=mesh.facets_satisfying(_outline(beam, H), boundaries_only=True), intorder=2)
    g = np.asarray(outer.interpolate(u).grad)
    exx, eyy, gxy = g[0, 0], g[1, 1], g[0, 1] + g[1, 0]
    sx, sy, t = E / (1 - nu**2) * (exx + nu * eyy), E / (1 - nu**2) * (eyy + nu * exx), shear * gxy
    stress = np.sqrt(sx**2 - sx * sy + sy**2 + 3.0 * t**2)
    x = outer.global_coordinates()[0].ravel()
    order = np.argsort(x)
    return Solution(abs(deflection), x[order], stress.ravel()[order], along * across)


def _outline(beam: Beam, H: Array):  # type: ignore[no-untyped-def]
    def on(x: Array) -> Array:
        inside = (x[0] > 1e-9) & (x[0] < beam.length - 1e-9)
        return np.asarray(inside & (np.abs(x[1]) > 0.25 * np.interp(x[0], beam.stations, H)))

    return on


def _require_one(case: LoadCases) -> None:
    if case.count != 1 or case.clamp[0] > 0.0:
        raise InputError("the finite elements need exactly one load case of a link clamped at its root")


def _body(beam: Beam, case: LoadCases, axis: int, x: Array) -> Array:
    """Return the body force of a link of height 1 m [N/m^2]."""
    a = case.acceleration[0, axis]
    return np.asarray(-beam.material.density * beam.width * (a[0] + a[1] * x))


def _at(basis: "object", x: Array) -> Array:
    """Return the degrees of freedom of a line's basis at positions x."""
    places = basis.doflocs[0]  # type: ignore[attr-defined]
    return np.array([int(np.argmin(np.abs(places - each))) for each in x])


def _shear(beam: Beam, case: LoadCases, H: Array, points: Array) -> Array:
    """Return the shear force by equilibrium, because Euler-Bernoulli theory does not give it."""
    from scipy.integrate import cumulative_simpson

    x = np.linspace(0.0, beam.length, 4001)
    load = _body(beam, case, 1, x) * np.interp(x, beam.stations, H)
    up_to = cumulative_simpson(load, x=x, initial=0.0)
    V = case.end_force[0, 1] + up_to[-1] - up_to
    if beam.support == "pinned":
        moment = case.end_moment[0] + case.end_force[0, 1] * beam.length + cumulative_simpson(load * x, x=x)[-1]
        V = V - moment / beam.length
    return np.asarray(np.interp(points, x, V))
