"""Checks of a strain-wave or planetary gearbox against its datasheet.

The rows follow Harmonic Drive's selection procedure. It is also applied to other makers' gearboxes,
because their own procedures were not found. If a datasheet does not give a figure, the row is
NOT CHECKABLE; it never passes.
"""

from collections.abc import Iterator

import numpy as np

from boom_model import Basis, Drive, Gearbox, Origin, wind_up
from planner.checks.drives.brake import power_off_row
from planner.checks.drives.joint_view import JointView, Shock
from planner.checks.kinds import CheckKind
from planner.checks.rows import Row, Verdict

FAMILY_LIFE = 35_000.0 * 3600.0
"""L50 of cup gearboxes of this kind at rated torque and FAMILY_INPUT_SPEED [s].

It is another maker's figure, so it is indicative only.
"""

FAMILY_INPUT_SPEED = 2000.0 * 2.0 * np.pi / 60.0
"""Input speed of FAMILY_LIFE [rad/s]."""

L50_OVER_L10 = 5.0
"""L50 / L10. Half of all gearboxes outlive L50, nine of ten outlive L10."""

LEAST_FREQUENCY = 8.0
"""Guideline for the first natural frequency of a base axis on its gearbox [Hz]."""

MOMENTARY_CYCLES = 1e4
"""Load cycles allowed at the momentary peak torque; the wave generator makes two per turn."""

_MAKER = "Harmonic Drive"


def gearbox_rows(view: JointView, drive: Drive, shock: Shock | None) -> Iterator[Row]:
    """Return every gearbox row: torque, speed, life, wind-up, lost motion, resonance, power-off."""
    gear = drive.gearbox
    procedure = Origin(Basis.PRINTED, f"{gear.source}; {_procedure(gear)}")
    yield from _torque_rows(view, gear, shock, procedure)
    yield from _speed_rows(view, gear)
    yield from _life_row(view, gear)
    yield from _compliance_rows(view, gear)
    yield _power_off_row(view, drive)


def _procedure(gear: Gearbox) -> str:
    own = gear.source.startswith(_MAKER)
    return f"{_MAKER}'s procedure" if own else f"{_MAKER}'s procedure applied to another maker's gearbox"


def _torque_rows(view: JointView, gear: Gearbox, shock: Shock | None, procedure: Origin) -> Iterator[Row]:
    if shock is not None:
        peak, at = view.peak(view.tau)
        unseen = Origin(Basis.PRINTED, "the shock is not within the motion, or has too few samples to show its peak")
        limit, origin = (gear.peak_torque, procedure) if shock.resolved else (None, unseen)
        yield view.compared(CheckKind.GEARBOX_MOMENTARY_PEAK, demand=peak, limit=limit, at=at, origin=origin)
        yield _events_row(view, gear, shock)
    peak, at = view.peak(view.tau_without_shock)
    yield view.compared(CheckKind.GEARBOX_REPEATED_PEAK, demand=peak, limit=gear.start_stop_torque, at=at, origin=procedure)
    average = view.duty.travel_mean(view.tau_without_shock, view.qd)
    if average is not None:
        yield view.compared(CheckKind.GEARBOX_AVERAGE, demand=average, limit=gear.max_average_torque, origin=procedure)
        rated = Origin(Basis.PRINTED, f"{gear.source}; rated torque, which determines the life and is not a limit")
        yield view.informative(CheckKind.GEARBOX_CONTINUOUS, figure=average, limit=gear.continuous_torque, origin=rated)
    hold, at = view.peak(view.static)
    derived = Origin(
        Basis.PRINTED, f"{gear.source}; static torque at the worst pose against the average torque [own derivation]"
    )
    yield view.compared(CheckKind.GEARBOX_HOLD, demand=hold, limit=gear.max_average_torque, at=at, origin=derived)


def _events_row(view: JointView, gear: Gearbox, shock: Shock) -> Row:
    """Return the row of the number of shocks against 1e4 / (2 (n / 60) N t).

    n is the joint's largest speed during the shock [rpm], N the gear ratio, t the duration. Of a
    planetary gearbox the sheet prints the number itself.
    """
    kind, speed = CheckKind.GEARBOX_MOMENTARY_PEAKS, float(np.abs(view.qd[shock.inside]).max(initial=0.0))
    turns = gear.ratio * speed / (2.0 * np.pi) * shock.duration
    allowed = MOMENTARY_CYCLES / max(2.0 * turns, 1.0)  # a shock at rest loads the teeth once
    origin = Origin(Basis.PRINTED, f"1e4 / (2 (n / 60) N t) with {turns:.2g} turns of the input per shock; {_procedure(gear)}")
    if gear.peak_events is not None:
        allowed, origin = gear.peak_events, Origin(Basis.PRINTED, gear.source)
    if shock.events is None or not shock.resolved:
        why = f"the number of shocks is not given (allowed: {allowed:.0f}); {origin.source}"
        return view.unknown(kind, why=why, demand=shock.events)
    return view.compared(kind, demand=shock.events, limit=allowed, origin=origin)


def _speed_rows(view: JointView, gear: Gearbox) -> Iterator[Row]:
    fastest, at = view.peak(view.qd)
    average = view.duty.mean(np.abs(view.qd))
    for kind, speed, limit, when in (
        (CheckKind.GEARBOX_INPUT_SPEED, fastest, gear.max_input_speed, at),
        (CheckKind.GEARBOX_AVERAGE_INPUT_SPEED, average, gear.max_average_input_speed, None),
    ):
        missing = "" if limit else "; this speed is not printed"
        sheet = Origin(Basis.PRINTED, gear.source + missing)
        yield view.compared(kind, demand=gear.ratio * speed, limit=limit, at=when, origin=sheet)


def _life_row(view: JointView, gear: Gearbox) -> Iterator[Row]:
    """Return the row of the life, L10 = L_n (n_N / n_av) (T_N / T_av)^3.

    L_n is the printed L10, or a fifth of the printed L50.

    Both the average speed and the life include pauses.
    """
    average = view.duty.travel_mean(view.tau_without_shock, view.qd)
    speed = gear.ratio * view.duty.mean(np.abs(view.qd))
    if average is None or average == 0.0:
        return
    wanted, kind = view.duty.required_life, CheckKind.GEARBOX_LIFE
    asked = None if wanted is None else wanted.value
    rated = rated_L10(gear)
    printed = rated is not None and gear.rated_input_speed is not None
    life, rated_speed = (rated, gear.rated_input_speed) if printed else (FAMILY_LIFE / L50_OVER_L10, FAMILY_INPUT_SPEED)
    L10 = None
    similar = printed or gear.peak_events is None  # a planetary gearbox wears otherwise
    if similar and gear.continuous_torque is not None and life is not None and rated_speed is not None:
        L10 = life * (rated_speed / speed) * (gear.continuous_torque / average) ** 3
    if L10 is None or not printed:
        figure = "" if L10 is None else f"; indicative L10 {L10 / 3600.0:,.0f} h from 35,000 h at 2000 rpm of similar gearboxes"
        why = f"{gear.source}; rated life or speed is not printed{figure}"
        yield view.unknown(kind, why=why, demand=asked, limit=L10)
        return
    from_L50 = "" if gear.rated_L10 is not None else "; L10 = L50 / 5"
    origin = Origin(Basis.PRINTED, f"{gear.source}{from_L50}; {_procedure(gear)}")
    if wanted is None:
        yield Row(
            joint=view.joint,
            kind=kind,
            demand=None,
            limit=L10,
            margin=None,
            at_s=None,
            verdict=Verdict.INFO,
            basis=origin.basis,
            source=origin.source,
        )
        return
    basis = Basis.weakest([origin.basis, wanted.origin.basis])
    both = Origin(basis, f"{origin.source}; required life: {wanted.origin.source}")
    yield view.compared(kind, demand=wanted.value, limit=L10, origin=both)


def rated_L10(gear: Gearbox) -> float | None:
    """Return the life L10 [s] at rated torque and input speed: printed, or a fifth of L50."""
    if gear.rated_L10 is not None:
        return gear.rated_L10
    return None if gear.rated_life is None else gear.rated_life / L50_OVER_L10


def _compliance_rows(view: JointView, gear: Gearbox) -> Iterator[Row]:
    sheet = Origin(Basis.PRINTED, gear.source)
    load, at = view.peak(view.tau)
    angle = wind_up(gear, load)
    yield view.informative(CheckKind.GEARBOX_WIND_UP, figure=None if angle is None else float(angle), at=at, origin=sheet)
    yield view.informative(CheckKind.GEARBOX_BACKLASH, figure=gear.backlash, origin=sheet)
    yield view.informative(CheckKind.GEARBOX_HYSTERESIS, figure=gear.hysteresis, origin=sheet)
    inertia = float(view.inertia.max())
    guide = Origin(Basis.PRINTED, f"guideline for sqrt(K1 / J) / (2 pi) at J = {inertia:.4g} kg m^2; {gear.source}")
    first = None
    if gear.torsion_stiffness is not None and inertia > 0.0:
        first = float(np.sqrt(gear.torsion_stiffness[0] / inertia) / (2.0 * np.pi))
    yield view.compared(CheckKind.GEARBOX_RESONANCE, demand=LEAST_FREQUENCY, limit=first, origin=guide)


def _power_off_row(view: JointView, drive: Drive) -> Row:
    """Return the row without power.

    Backdriving starts near the printed torque, so that torque is not a holding limit.
    """
    demand, at = view.peak(view.static)
    why = drive.gearbox.source
    return power_off_row(
        view,
        demand=demand,
        limit=drive.gearbox.backdrive_torque,
        at=at,
        brake=drive.brake,
        with_brake=f"without it the gearbox can be backdriven, {why}",
        without_brake=f"no brake is declared and the gearbox can be backdriven: {why}",
    )
