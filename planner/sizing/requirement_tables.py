"""Requirement sheets as tables, Markdown and JSON."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planner.checks.energy import ENERGY_HEADER, energy_cells
from planner.reports.markdown import section, table
from planner.sizing.day import Day
from planner.sizing.offer import Offer
from planner.sizing.requirement import Point, Requirement

SHEET = ("joint", "largest", "cube mean", "hold", "top speed", "power", "inertia", "starts", "drive")
"""Columns of `sheet_rows`: one row per joint."""

OFFER_HEADER = ("drive of the catalogue", "not enough", "not printed")
_RPM = 30.0 / np.pi
_DATA_TURNING = (
    "To be printed on the datasheet: torque-speed curve or winding data with bus voltage and wiring, holding torque, rotor "
    "inertia, current and resistance; gear ratio, efficiency, no-load torque, input inertia, start-stop, average and rated "
    "torque, largest and average input speed, rated life and its speed, stiffness, backlash, hysteresis; brake; mass"
)
_DATA_LINEAR = (
    "To be printed on the datasheet: rated, peak and static force, speed, stroke, lead, efficiency, duty, back-driving force, "
    "brake, mass"
)


def sheet_rows(needs: Sequence[Requirement]) -> list[tuple[str, ...]]:
    """Return one row per joint under SHEET."""
    return [
        (
            need.joint,
            _load(need, need.peak.torque),
            "-" if need.mean is None else _load(need, need.mean),
            _load(need, need.hold.torque),
            _speed(need, need.top_speed),
            f"{need.output_power:.3g} W",
            _inertia(need, need.inertia[1]),
            f"{need.starts:.0f}",
            "fitted" if need.fitted else "none",
        )
        for need in needs
    ]


def items(need: Requirement) -> list[tuple[str, str]]:
    """Return item and value of everything on the sheet but the torque-speed table."""
    force = "force" if need.is_length else "torque"
    turns = need.travel / (2.0 * np.pi)
    found = [
        (f"largest {force}", _point(need, need.peak)),
        (
            f"cube mean {force} over the travel",
            "-" if need.mean is None else f"{_load(need, need.mean)} at {_speed(need, need.moving_speed)} on average in motion",
        ),
        (f"RMS {force} over the cycle", _load(need, need.rms)),
        (f"largest static {force}, without power held by a brake", f"{_load(need, need.hold.torque)} at rest"),
        (f"{force} of the slowest motion", _load(need, need.creep)),
        ("largest speed", _speed(need, need.top_speed)),
        ("mean speed over the cycle, pauses included", _speed(need, need.mean_speed)),
        ("largest output power, driving", f"{need.output_power:.4g} W"),
        ("largest power given back, braking", f"{need.braking_power:.4g} W"),
        (
            "moved mass" if need.is_length else "inertia of the load at the joint",
            f"{_inertia(need, need.inertia[0])} to {_inertia(need, need.inertia[1])}",
        ),
        (
            f"reflected {'mass' if need.is_length else 'inertia'} of the drive at the joint",
            f"{_largest_reflected(need)}; the rotor's at least {_inertia(need, need.least_reflected)} (guideline)",
        ),
        (
            f"stiffness for {need.frequency:g} Hz",
            f"{_stiffness(need, need.stiffness)} with the other joints rigid; "
            f"{_stiffness(need, need.stiffness_together)} if every joint has its share",
        ),
        ("backlash", _backlash(need)),
        ("travel", f"{_stroke(need)}; {_travel(need, need.travel, turns)} a cycle of {need.cycle_s:.0f} s"),
        ("moves a cycle", f"{need.starts:.0f}, in motion {need.moving_share:.2%} of the time"),
        ("life", _life(need)),
    ]
    if not need.is_length:
        found.append(("margin asked of a stepper motor", f"{need.margin:.0%} over torque at speed and holding torque"))
    return found


def step_header(need: Requirement) -> tuple[str, ...]:
    """Return the header of `step_rows`."""
    return "speed up to", "force" if need.is_length else "torque", "acceleration"


def step_rows(need: Requirement) -> list[tuple[str, ...]]:
    """Return the torque-speed table under `step_header`."""
    unit = "m/s^2" if need.is_length else "rad/s^2"
    return [(_speed(need, step.speed), _load(need, step.torque), f"{step.acceleration:.3g} {unit}") for step in need.steps]


def offer_rows(offers: Sequence[Offer]) -> list[tuple[str, ...]]:
    """Return the drives that come nearest to a sheet, under OFFER_HEADER."""
    return [
        (offer.name, *(", ".join(each.item for each in group) or "-" for group in (offer.short, offer.unprinted)))
        for offer in offers
    ]


def requirement_markdown(
    title: str,
    needs: Sequence[Requirement],
    day: Day,
    offers: Mapping[str, Sequence[Offer]],
    notes: Sequence[str],
    assumed: Sequence[str],
) -> str:
    """Return the sheets for a supplier as Markdown; power and energy of fitted drives first.

    Args:
        title: the title.
        needs: a sheet for each joint.
        day: power and energy.
        offers: the drives of the catalogue that come nearest to each sheet, by joint.
        notes: see `requirement_notes`.
        assumed: what is assumed.
    """
    lines = [f"# {title}", "", *table(SHEET, sheet_rows(needs))]
    lines += ["", "## Power and energy", "", *table(ENERGY_HEADER, map(energy_cells, day.energy.joints))]
    lines += [f"\n{sentence}" for sentence in (*day.energy.sentences, *day.sentences)]
    for need in needs:
        lines += ["", "---", "", f"## {need.joint}", "", *table(("required", "value"), items(need))]
        lines += ["", *table(step_header(need), step_rows(need)), "", _DATA_LINEAR if need.is_length else _DATA_TURNING]
    found = [(joint, *row) for joint, group in offers.items() for row in offer_rows(group)]
    nearest = ["", "## Nearest drives of the catalogue", "", *table(("joint", *OFFER_HEADER), found)] if found else []
    lines += ["", "---", *nearest]
    return "\n".join([*lines, *section("Notes", notes), *section("Assumed", assumed)]) + "\n"


def requirement_json(need: Requirement, offers: Sequence[Offer] = ()) -> dict[str, Any]:
    """Return a sheet as a JSON object, in SI; the extension's units stand in its keys.

    Args:
        need: the sheet.
        offers: the drives of the catalogue that come nearest to it.
    """
    T, w, a, J, K, x = ("N", "m_s", "m_s2", "kg", "N_m", "m") if need.is_length else (
        "Nm", "rad_s", "rad_s2", "kg_m2", "Nm_rad", "rad"
    )  # fmt: skip
    load = "force" if need.is_length else "torque"
    return {
        "joint": need.joint,
        "fitted": need.fitted,
        f"peak_{load}_{T}": need.peak.torque,
        f"peak_speed_{w}": need.peak.speed,
        "peak_at_s": need.peak.at_s,
        f"cube_mean_{load}_{T}": need.mean,
        f"mean_speed_moving_{w}": need.moving_speed,
        f"mean_speed_{w}": need.mean_speed,
        f"rms_{load}_{T}": need.rms,
        f"holding_{load}_{T}": need.hold.torque,
        f"slowest_motion_{load}_{T}": need.creep,
        f"top_speed_{w}": need.top_speed,
        "output_power_W": need.output_power,
        "braking_power_W": need.braking_power,
        f"inertia_{J}": list(need.inertia),
        f"largest_reflected_inertia_{J}": None if np.isinf(need.largest_reflected) else need.largest_reflected,
        f"least_rotor_inertia_{J}": need.least_reflected,
        "frequency_Hz": need.frequency,
        f"stiffness_{K}": need.stiffness,
        f"stiffness_together_{K}": need.stiffness_together,
        "tip_error_m": need.tip_error,
        f"backlash_{x}": need.backlash,
        f"stroke_{x}": need.stroke,
        f"travel_{x}": need.travel,
        "moves": need.starts,
        "moving_share": need.moving_share,
        "cycle_s": need.cycle_s,
        "life_s": need.life_s,
        "life_moves": need.life_starts,
        "motor_margin": need.margin,
        "torque_speed": [
            {f"speed_{w}": step.speed, f"{load}_{T}": step.torque, f"acceleration_{a}": step.acceleration}
            for step in need.steps
        ],
        "hull": [{f"speed_{w}": float(v), f"{load}_{T}": float(t)} for v, t in need.cloud.hull],
        "nearest": [
            {
                "drive": offer.name,
                "not_enough": {each.item: {"asked": each.asked, "offered": each.offered} for each in offer.short},
                "not_printed": [each.item for each in offer.unprinted],
            }
            for offer in offers
        ],
    }


def requirement_notes(needs: Sequence[Requirement]) -> tuple[str, ...]:
    """Return the notes that explain the sheets."""
    notes = [
        "torques are at the joint and contain no drive's own inertia J; add J times the acceleration of the same row",
        "a row of the torque-speed table holds from the speed of the row before; torque in either direction of the motion",
        "the largest reflected inertia takes the largest torque again at the largest acceleration [own choice]",
        "a drive that meets the sheet, with every figure printed, passes every limit check of boom size on this mission",
        "the motion is planned within the limits of the drives that are fitted; the brake needs its own figure",
    ]
    if any(need.tip_error is None for need in needs):
        notes.append("backlash is not asked: --tip-error MM states the error of the tip, or the mission's tip_tolerance_mm")
    return tuple(notes)


def _load(need: Requirement, value: float) -> str:
    return f"{float(f'{value:.4g}'):.12g} {'N' if need.is_length else 'Nm'}"


def _speed(need: Requirement, value: float) -> str:
    return f"{value * 1e3:.4g} mm/s" if need.is_length else f"{value * _RPM:.4g} rpm"


def _inertia(need: Requirement, value: float) -> str:
    return f"{value:.3g} {'kg' if need.is_length else 'kg m^2'}"


def _largest_reflected(need: Requirement) -> str:
    return "any" if np.isinf(need.largest_reflected) else f"at most {_inertia(need, need.largest_reflected)}"


def _stiffness(need: Requirement, value: float) -> str:
    return f"{value / 1e3:.4g} {'N/mm' if need.is_length else 'kNm/rad'}"


def _point(need: Requirement, point: Point) -> str:
    return f"{_load(need, point.torque)} at {_speed(need, point.speed)}, {point.at_s:.2f} s"


def _backlash(need: Requirement) -> str:
    if need.tip_error is None:
        return "not asked"
    if need.backlash is None:
        return "any; the joint does not move the tip"
    figure = f"{need.backlash * 1e3:.3g} {'mm' if need.is_length else 'mrad'}"
    return f"at most {figure}, for {need.tip_error * 1e3:.4g} mm of the tip by all joints together"


def _stroke(need: Requirement) -> str:
    return f"stroke {need.stroke * 1e3:.4g} mm" if need.is_length else f"range {np.degrees(need.stroke):.4g} deg"


def _travel(need: Requirement, travel: float, turns: float) -> str:
    return f"{travel:.4g} m" if need.is_length else f"{turns:.4g} turns of the joint"


def _life(need: Requirement) -> str:
    if need.life_s is None:
        return "not asked; the mission states no required_life_h"
    return f"{need.life_s / 3600.0:,.0f} h, {need.life_starts:,.0f} moves"
