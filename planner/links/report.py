"""Link design as text, Markdown and JSON."""

from dataclasses import asdict
from typing import Any

import numpy as np

from boom_model import JOINTS
from planner.links.convergence import PLACES, Convergence
from planner.links.design import INSIDE, LinkDesign
from planner.reports.markdown import section, table
from planner.reports.report import assumptions


def to_json(design: LinkDesign, files: dict[str, str]) -> dict[str, Any]:
    """Return the JSON object of `boom link`, in SI."""
    exact = design.exact
    least, most = (None, None) if design.link.fittings is None else design.saved
    before, after = (float(np.abs(t).max()) for t in design.torques)
    return {
        "link": design.link.name,
        "load": str(design.task.load),
        "method": str(design.task.method),
        "material": design.task.material,
        "slices": design.beam.slices,
        "mass_kg": design.mass,
        "tip_deflection_m": design.found.deflection,
        "max_stress_Pa": design.max_stress,
        "buckling_load_N": design.buckling_load,
        "stress_only": {
            "mass_kg": design.found.stress_mass,
            "tip_deflection_m": design.found.stress_deflection,
            "max_height_m": float(design.found.stress_heights.max()),
            "tip_height_m": float(design.found.stress_heights[-1]),
        },
        "max_height_m": float(design.heights.max()),
        "tip_height_m": float(design.heights[-1]),
        "limits": asdict(design.limits),
        "deflection_with_own_mass_and_shear_m": design.own_deflection,
        "tapered_buckling_load_N": design.tapered_load,
        "end_load_N": design.pressed,
        "lower_bound_kg": None if exact is None else exact.lower_bound,
        "gap": None if exact is None else exact.gap,
        "equal_constraints": None
        if design.equal_constraints is None
        else dict(zip(("thesis_kg", "exact_kg"), design.equal_constraints, strict=True)),
        "load_cases": design.cases.count,
        "governing": [] if exact is None or design.instants is None else design.instants[list(exact.governing)].tolist(),
        "checks": [
            {
                "model": c.model,
                "elements": c.elements,
                "tip_deflection_m": c.deflection,
                "max_stress_Pa": c.stress,
                "stress_between": list(INSIDE),
            }
            for c in design.checks
        ],
        "stress_check": None
        if design.stress_check is None
        else {
            "x_m": design.stress_check.x,
            "elements": design.stress_check.elements,
            "by_elements_Pa": design.stress_check.by_elements,
            "own_Pa": design.stress_check.own,
        },
        "body": {
            "mass_kg": design.body.mass,
            "com_m": design.body.com.tolist(),
            "inertia_kg_m2": design.body.inertia.tolist(),
            "mass_before_kg": design.before.bodies[design.link.name].mass,
        },
        "torque": {
            "joint": JOINTS[design.joint],
            "peak_before_Nm": before,
            "peak_after_Nm": after,
            "saved_least": least,
            "saved_most": most,
        },
        "motors": [
            {
                "motor": m.motor,
                "mass_kg": m.mass,
                "before": m.before,
                "after": m.after,
                "margin_before": m.margin_before,
                "margin_after": m.margin_after,
            }
            for m in design.motors
        ],
        "notes": [*design.warnings, *design.notes],
        "files": files,
    }


def convergence_json(found: Convergence) -> dict[str, Any]:
    """Return the convergence studies in SI: rows with the varied number first."""
    return {
        "slices_mass_kg": found.slices.tolist(),
        "step_mass_kg": None if found.steps is None else found.steps.tolist(),
        "stepless_kg": found.stepless,
        "elements_deflection_m": {name: curve.tolist() for name, curve in found.deflections.items()},
        "elements_stress_Pa": None if found.stresses is None else {"places": PLACES, "rows": found.stresses.tolist()},
    }


ROWS_HEADER = ("quantity", "stress only", "design", "limit")


def rows(design: LinkDesign) -> list[tuple[str, str, str, str]]:
    """Return the main figures of the design, under ROWS_HEADER."""
    limits, exact = design.limits, design.exact
    top = "-" if limits.max_height is None else f"{1e3 * limits.max_height:.4g} mm"
    factor = "-" if limits.buckling_factor is None else f"{limits.buckling_factor * max(design.pressed, 0.0):.0f} N"
    where = "end" if design.beam.support == "cantilever" else "middle"
    found = [
        ("plates, pin to pin", f"{design.found.stress_mass:.4f} kg", f"{design.mass:.4f} kg", "-"),
        (
            f"deflection of the {where}",
            f"{1e3 * design.found.stress_deflection:.3f} mm",
            f"{1e3 * design.found.deflection:.3f} mm",
            f"{1e3 * limits.deflection:.4g} mm",
        ),
        ("  with own mass and shear", "-", f"{1e3 * design.own_deflection:.3f} mm", f"{1e3 * limits.deflection:.4g} mm"),
        ("largest von Mises stress", "-", f"{1e-6 * design.max_stress:.1f} MPa", f"{1e-6 * limits.stress:.4g} MPa"),
        (
            "height, largest",
            f"{1e3 * design.found.stress_heights.max():.2f} mm",
            f"{1e3 * design.heights.max():.2f} mm",
            top,
        ),
        (
            "height, end",
            f"{1e3 * design.found.stress_heights[-1]:.2f} mm",
            f"{1e3 * design.heights[-1]:.2f} mm",
            f"{1e3 * limits.min_height:.4g} mm",
        ),
        ("buckling, tapered column", "-", f"{design.tapered_load:.0f} N", factor),
    ]
    if design.thesis is not None:
        found.append(("buckling, thesis's formula", "-", f"{design.buckling_load:.0f} N", factor))
    if exact is not None:
        gap = (
            "none proven"
            if exact.lower_bound is None or exact.gap is None
            else f"{exact.lower_bound:.4f} kg, gap {exact.gap:.1g}"
        )
        found.append(("lower bound of the mass", "-", gap, "-"))
    if design.equal_constraints is not None:
        theirs, ours = design.equal_constraints
        found.append(("plates with the thesis's constraints", "-", f"{theirs:.4f} kg thesis, {ours:.4f} kg exact", "-"))
    return found


def check_rows(design: LinkDesign) -> list[tuple[str, str, str, str]]:
    """Return the checks by finite elements, under ROWS_HEADER."""
    within = "stress at {:.0f} to {:.0f} % of the length".format(*(100.0 * share for share in INSIDE))
    found = [
        (
            f"check: {c.model}, {c.elements} elements; {within}",
            "-",
            f"{1e3 * c.deflection:.3f} mm, {1e-6 * c.stress:.1f} MPa",
            "-",
        )
        for c in design.checks
    ]
    if (s := design.stress_check) is not None:
        found.append(
            (
                f"check: Euler-Bernoulli beam, {s.elements} elements; where the stress is largest, x = {s.x:.4g} m",
                "-",
                f"{1e-6 * s.by_elements:.1f} MPa, design {1e-6 * s.own:.1f} MPa",
                f"{1e-6 * design.limits.stress:.4g} MPa",
            )
        )
    return found


def sentences(design: LinkDesign) -> list[str]:
    """Return sentences about the effect of the new link on the boom."""
    old, new = design.before.bodies[design.link.name].mass, design.body.mass
    before, after = (float(np.abs(t).max()) for t in design.torques)
    known = design.link.fittings
    return [
        f"{design.link.name} link: {old:.3f} kg before, {new:.3f} kg now, fittings "
        f"{'not included' if known is None else f'of {known.mass:.3f} kg included'}",
        f"{JOINTS[design.joint]} torque, largest: {before:.1f} Nm before, {after:.1f} Nm now; {_saving(*design.saved)}"
        if known is not None
        else f"{JOINTS[design.joint]} torque, largest: {before:.1f} Nm before; saving unknown without the fittings' mass",
    ]


def _saving(least: float, most: float) -> str:
    if most < 0.0:
        return f"{-100 * most:.2f} to {-100 * least:.2f} % more along the moves"
    if least < 0.0:
        return f"from {-100 * least:.2f} % more to {100 * most:.2f} % less along the moves"
    return f"{100 * least:.2f} to {100 * most:.2f} % less along the moves"


MOTORS_HEADER = ("motor", "mass", "before", "margin", "now", "margin")


def motor_rows(design: LinkDesign) -> list[tuple[str, ...]]:
    """Return a row per motor of the catalogue at the joint of the link, under MOTORS_HEADER."""

    def percent(margin: float | None) -> str:
        return "-" if margin is None else f"{margin:.0%}"

    return [
        (
            m.motor,
            "-" if m.mass is None else f"{m.mass:g} kg",
            str(m.before),
            percent(m.margin_before),
            str(m.after),
            percent(m.margin_after),
        )
        for m in design.motors
    ]


def to_markdown(design: LinkDesign) -> str:
    """Return the report as Markdown."""
    lines = [f"# {title(design)}", "", *(f"- {text}" for text in sentences(design)), ""]
    for header, body in ((ROWS_HEADER, [*rows(design), *check_rows(design)]), (MOTORS_HEADER, motor_rows(design))):
        if body:
            lines += [*table(header, body), ""]
    assumed = assumptions(design.before, any(motion.qddd is not None for motion in design.trajectories))
    return "\n".join([*lines[:-1], *section("Notes", (*design.warnings, *design.notes)), *section("Assumed", assumed)]) + "\n"


def title(design: LinkDesign) -> str:
    """Return the title: boom, link, method, loads and material."""
    task = design.task
    return f"{design.before.name}: {design.link.name} link, {task.method} method, loads of {task.load}, {task.material}"
