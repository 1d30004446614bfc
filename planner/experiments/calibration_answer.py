"""What a calibration answers: sentences, rows and JSON."""

from typing import Any

import numpy as np

from boom_model.boom import IS_LENGTH
from boom_model.calibration import LENGTHS, OFFSETS, SCALE, WIND_UPS
from planner.experiments.calibration import USUAL_SD, Calibrated, Check, Parameter, rms
from planner.experiments.calibration_model import SIDEWAYS

HEADER = ("figure", "was", "is", "sd", "unit")
DETAILS = (SCALE, *WIND_UPS, SIDEWAYS)
"""Figures that the short answer names only."""

HELD_HEADER = ("held", "at", "unit", "cannot be told from")


def unit_of(name: str) -> tuple[str, float]:
    """Return the unit in which people read a parameter, and what makes its SI value so."""
    if name in OFFSETS and not IS_LENGTH[OFFSETS.index(name)]:
        return "deg", 180.0 / np.pi
    return ("mm", 1e3) if name in (*LENGTHS, *OFFSETS, SIDEWAYS) else ("1", 1.0)


def cells(parameter: Parameter) -> tuple[str, ...]:
    """Return the row of a measured parameter."""
    unit, by = unit_of(parameter.name)
    assert parameter.sd is not None
    places = {"mm": 2, "deg": 3, "1": 4}[unit]
    shown = (f"{x * by:.{places}f}" for x in (parameter.start, parameter.value, parameter.sd))
    return (parameter.name, *shown, unit)


def held_cells(parameter: Parameter) -> tuple[str, ...]:
    """Return the row of a parameter that is held."""
    unit, by = unit_of(parameter.name)
    alike = ", ".join(parameter.alike) or "noise: these poses do not move the tip by it"
    return (parameter.name, f"{parameter.value * by:.6g}", unit, alike)


def sentences(found: Calibrated, check: Check | None) -> list[str]:
    """Return the answer in words, the most important first."""
    said = [
        f"tip error {rms(found.before) * 1e3:.2f} mm before, {found.held_out_rms * 1e3:.2f} mm now at poses left out of the fit"
    ]
    if check is not None:
        said.append(
            f"{check.poses} poses of --check: {check.before * 1e3:.2f} mm before, {check.after * 1e3:.2f} mm now; "
            f"the data allow {check.expected * 1e3:.2f} mm"
        )
    if found.stated:
        wider = " (intervals are widened: --all)" if found.widened else ""
        said.append(f"the residuals are {found.sd_factor:.2g} times the stated noise{wider}")
    else:
        said.append(f"noise of a coordinate, from the residuals: {found.sd_factor * USUAL_SD * 1e3:.2g} mm")
    said.append(_linkage(found))
    return said


def _linkage(found: Calibrated) -> str:
    g = found.boom.geometry
    if found.equal_links_rms is None or found.equal_links_chance is None:
        return "links of the linkage: " + ("unequal" if found.unequal else "equal, as asked or as the data leave it open")
    if not found.unequal:
        return f"equal links fit as well ({found.equal_links_rms * 1e3:.2f} mm); they are kept"
    return (
        f"unequal links: L5 - L3 {g.upper_less_lower * 1e3:+.2f} mm, L9 - L4 {g.inner_less_outer * 1e3:+.2f} mm; "
        f"equal ones leave {found.equal_links_rms * 1e3:.2f} mm"
    )


def to_json(found: Calibrated, check: Check | None, files: dict[str, str]) -> dict[str, Any]:
    """Return the JSON object of `boom calibrate`, in SI."""
    return {
        "poses": len(found.used),
        "left_out": [int(i) + 1 for i in np.flatnonzero(~found.used)],
        "before_rms_m": rms(found.before),
        "residual_rms_m": rms(found.residuals[found.used]),
        "held_out_rms_m": found.held_out_rms,
        "sd_factor": found.sd_factor,
        "parameters": [
            {
                "name": p.name,
                "unit": _si(p.name),
                "start": p.start,
                "value": p.value,
                "sd": p.sd,
                "held": p.sd is None,
                "alike": list(p.alike),
            }
            for p in found.parameters
        ],
        "fitted": list(found.free),
        "covariance": found.covariance.tolist(),
        "singular_values": found.singular_values.tolist(),
        "held_singular_values": found.dropped_values.tolist(),
        "linkage": {
            "unequal": found.unequal,
            "equal_links_rms_m": found.equal_links_rms,
            "equal_links_chance": found.equal_links_chance,
        },
        "frame": {"R": found.model.frame.R.tolist(), "t_m": found.model.frame.t.tolist()},
        "check": None
        if check is None
        else {
            "poses": check.poses,
            "before_rms_m": check.before,
            "after_rms_m": check.after,
            "expected_rms_m": check.expected,
        },
        "notes": [*found.interval_notes, *found.notes],
        "files": files,
    }


def _si(name: str) -> str:
    if name == SCALE or name in WIND_UPS:
        return "1"
    return "rad" if unit_of(name)[0] == "deg" else "m"
