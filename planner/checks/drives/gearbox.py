"""A strain-wave gearbox against its datasheet.

The rows follow Harmonic Drive's selection procedure, applied to the Cone Drive CBG, whose maker's own procedure was not found.
A figure that a datasheet does not give makes its row NOT CHECKABLE, never a pass.
"""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Drive, Gearbox, Origin, wind_up
from planner.checks.drives.joint_view import JointView, Shock
from planner.checks.rows import Row, Verdict

FAMILY_LIFE = 35_000.0 * 3600.0
"""L50 of cup gearboxes of this kind at rated torque and FAMILY_INPUT_SPEED [s]; another maker's, so indicative only."""

FAMILY_INPUT_SPEED = 2000.0 * 2.0 * np.pi / 60.0
"""[rad/s]"""

L50_OVER_L10 = 5.0
"""Half of them outlive L50, nine of ten L10."""

LEAST_FREQUENCY = 8.0
"""Guide for the first natural frequency of a base axis on its gearbox [Hz]."""

MOMENTARY_CYCLES = 1e4
"""Turns of the wave generator, two a revolution, that a gearbox may bear its momentary peak torque for."""

_PROCEDURE = "Harmonic Drive's procedure, applied to another maker's gearbox"


def gearbox_rows(view: JointView, drive: Drive, shock: Shock | None) -> Iterator[Row]:
    """Every gearbox row of a joint: torques, speeds, life, wind-up, lost motion, resonance, power-off."""
    gear = drive.gearbox
    procedure = Origin(Basis.PRINTED, f"{gear.source}; {_PROCEDURE}")
    yield from _torque_rows(view, gear, shock, procedure)
    yield from _speed_rows(view, gear)
    yield from _life_row(view, gear)
    yield from _compliance_rows(view, gear)
    yield _power_off_row(view, drive)


def _torque_rows(view: JointView, gear: Gearbox, shock: Shock | None, procedure: Origin) -> Iterator[Row]:
    if shock is not None:
        peak, at = view.peak(view.tau)
        unseen = Origin(Basis.PRINTED, "the shock is not inside the motion, or has too few samples to see its peak")
        limit, origin = (gear.peak_torque, procedure) if shock.resolved else (None, unseen)
        yield view.held("gearbox momentary peak", peak, limit, "Nm", at, origin)
        yield _events_row(view, gear, shock)
    peak, at = view.peak(view.calm)
    yield view.held("gearbox repeated peak", peak, gear.start_stop_torque, "Nm", at, procedure)
    average = view.duty.travel_mean(view.calm, view.qd)
    if average is not None:
        yield view.held("gearbox average", average, gear.max_average_torque, "Nm", None, procedure)
        rated = Origin(Basis.PRINTED, f"{gear.source}; rated torque, which enters the life and is no limit of its own")
        yield view.told("gearbox continuous", average, "Nm", None, rated, gear.continuous_torque)
    hold, at = view.peak(view.static)
    derived = Origin(
        Basis.PRINTED, f"{gear.source}; held for ever at the worst pose, against the average rating [own derivation]"
    )
    yield view.held("gearbox hold", hold, gear.max_average_torque, "Nm", at, derived)


def _events_row(view: JointView, gear: Gearbox, shock: Shock) -> Row:
    """How often the shock may come: 1e4 / (2 (n / 60) N t), with the joint's fastest speed n while it lasts."""
    check, speed = "gearbox momentary peaks", float(np.abs(view.qd[shock.inside]).max(initial=0.0))
    turns = gear.ratio * speed / (2.0 * np.pi) * shock.duration
    allowed = MOMENTARY_CYCLES / max(2.0 * turns, 1.0)  # a shock at rest still loads the teeth once
    origin = Origin(Basis.PRINTED, f"1e4 / (2 (n / 60) N t), at {turns:.2g} turns of the input in a shock; {_PROCEDURE}")
    if shock.events is None or not shock.resolved:
        why = f"how many shocks it is to survive is not given (it bears {allowed:.0f}); {origin.source}"
        return Row(view.joint, check, shock.events, None, "times", None, 0.0, None, Verdict.NOT_CHECKABLE, None, why)
    return view.held(check, shock.events, allowed, "times", None, origin)


def _speed_rows(view: JointView, gear: Gearbox) -> Iterator[Row]:
    fastest, at = view.peak(view.qd)
    average = view.duty.mean(np.abs(view.qd))
    for check, speed, limit, when in (
        ("gearbox input speed", fastest, gear.max_input_speed, at),
        ("gearbox average input speed", average, gear.max_average_input_speed, None),
    ):
        missing = "" if limit else "; no such speed is printed"
        yield view.held(check, gear.ratio * speed, limit, "rad/s", when, Origin(Basis.PRINTED, gear.source + missing))


def _life_row(view: JointView, gear: Gearbox) -> Iterator[Row]:
    """L50 = L_n (n_N / n_av) (T_N / T_av)^3, against L10; the average speed counts pauses, and so does the life."""
    average = view.duty.travel_mean(view.calm, view.qd)
    speed = gear.ratio * view.duty.mean(np.abs(view.qd))
    if average is None or average == 0.0:
        return
    wanted, check = view.duty.required_life, "gearbox life"
    asked = None if wanted is None else wanted.value
    printed = gear.rated_life is not None and gear.rated_input_speed is not None
    life, rated_speed = (gear.rated_life, gear.rated_input_speed) if printed else (FAMILY_LIFE, FAMILY_INPUT_SPEED)
    L10 = None
    if gear.continuous_torque is not None and life is not None and rated_speed is not None:
        L10 = life * (rated_speed / speed) * (gear.continuous_torque / average) ** 3 / L50_OVER_L10
    if L10 is None or not printed:
        figure = (
            "" if L10 is None else f"; indicative L10 {L10 / 3600.0:,.0f} h, with 35,000 h at 2000 rpm of others of its kind"
        )
        why = f"{gear.source}; no rated life and speed are printed{figure}"
        yield Row(view.joint, check, asked, L10, "s", None, 0.0, None, Verdict.NOT_CHECKABLE, None, why)
        return
    origin = Origin(Basis.PRINTED, f"{gear.source}; L10 = L50 / 5; {_PROCEDURE}")
    if wanted is None:
        yield Row(view.joint, check, None, L10, "s", None, 0.0, None, Verdict.INFO, origin.basis, origin.source)
        return
    basis = Basis.weakest([origin.basis, wanted.origin.basis])
    yield view.held(check, wanted.value, L10, "s", None, Origin(basis, f"{origin.source}; asked: {wanted.origin.source}"))


def _compliance_rows(view: JointView, gear: Gearbox) -> Iterator[Row]:
    sheet = Origin(Basis.PRINTED, gear.source)
    load, at = view.peak(view.tau)
    angle = wind_up(gear, load)
    yield view.told("gearbox wind-up", None if angle is None else float(angle), "rad", at, sheet)
    yield view.told("gearbox backlash", gear.backlash, "rad", None, sheet)
    yield view.told("gearbox hysteresis", gear.hysteresis, "rad", None, sheet)
    inertia = float(view.inertia.max())
    guide = Origin(Basis.PRINTED, f"sqrt(K1 / J) / (2 pi) at J = {inertia:.4g} kg m^2, against a guide; {gear.source}")
    first = None
    if gear.torsion_stiffness is not None and inertia > 0.0:
        first = float(np.sqrt(gear.torsion_stiffness[0] / inertia) / (2.0 * np.pi))
    yield view.guided("gearbox resonance", LEAST_FREQUENCY, first, "Hz", None, guide)


def _power_off_row(view: JointView, drive: Drive) -> Row:
    """Backdriving starts somewhere about the printed torque, which is no holding margin: only a brake holds."""
    demand, at = view.peak(view.static)
    facts = (view.joint, "power-off hold", demand, drive.gearbox.backdrive_torque, "Nm", None, 0.0, at)
    brake, sheet = drive.brake, drive.gearbox.source
    if brake is not None and brake.value:
        verdict = Verdict.WARN if brake.origin.basis is not Basis.PRINTED else Verdict.PASS
        return Row(
            *facts, verdict, brake.origin.basis, f"held by a brake: {brake.origin.source}; backdriven otherwise, {sheet}"
        )
    return Row(*facts, Verdict.FAIL, Basis.PRINTED, f"no brake is declared, and the gearbox is backdriven: {sheet}")
