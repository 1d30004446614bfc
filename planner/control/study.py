"""Study of the tracking error for every combination of move, controller and shaper."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from boom_model import JOINTS, Boom, forward_kinematics
from boom_model.arrays import Array
from boom_model.errors import InputError
from planner.control.closed_loop import Case, Command, Gust, Run, simulate
from planner.control.design import Controller, Goals, Loop, analyse
from planner.control.figures import Figures
from planner.control.plant import Plant, natural_frequencies
from planner.control.shaping import Impulses, Shaper, impulses
from planner.motion.vehicle import VehicleCase
from planner.planning import Move
from planner.progress import Track
from planner.reports.markdown import section, table
from planner.reports.report import assumptions

POSES = 9
"""Number of poses along a move at which the poles of the loop are computed."""


class Outcome(StrEnum):
    """Outcome of a case."""

    FOLLOWS = "follows"
    SATURATES = "saturates"
    UNSTABLE = "UNSTABLE"
    LOST_STEP = "LOST STEP"


FAILED = (Outcome.UNSTABLE, Outcome.LOST_STEP)
"""Outcomes with which a study fails."""


@dataclass(frozen=True)
class Setup:
    """Settings of a study."""

    goals: Goals = field(default_factory=Goals)
    figures: Figures = field(default_factory=Figures)
    elastic: bool = True
    bending: bool = True
    backlash: bool = False
    compensate_sag: bool = False
    payload_error: float = 0.0
    """True payload minus the payload that planning and controllers assume [kg]."""
    vehicle: VehicleCase | None = None
    gust: Gust | None = None
    hold: float = 2.0
    """Simulated time after the end of the longest command [s]."""
    settled: float = 1e-3
    """Distance from the final position [m] within which the tip counts as settled."""


@dataclass(frozen=True)
class Row:
    """Result of one controller on one command, in SI. Figures of a diverged case are None."""

    profile: str
    controller: str
    shaper: str
    duration_s: float
    """Duration of the command, including the shaper's delay."""
    outcome: Outcome
    reason: str
    """Reason why the outcome is not FOLLOWS; empty otherwise."""
    tip_error_peak_m: float | None
    """Largest distance of the tip from its command, until the end of the simulation."""
    tip_error_rms_m: float | None
    """RMS distance of the tip from its command, until the end of the command."""
    tip_error_end_m: float | None
    """Tip error at the end of the simulation, mainly the sag of an elastic boom."""
    joint_error_peak: tuple[float, ...] | None
    joint_error_rms: tuple[float, ...] | None
    overshoot: float | None
    """Largest overshoot of a joint beyond its final position, divided by its travel."""
    settling_s: float | None
    """Time from the end of the command until the tip stays settled; None if it does not settle."""
    residual_vibration_m: float | None
    """Largest deviation of the tip, after the end, from its mean over one lowest-mode period."""
    peak_torque_ratio: float | None
    """Largest |torque command| / torque of the motor at its speed, where that is known."""
    saturated_share: float
    """Share of the samples, until a case diverged, at which a motor is saturated."""


@dataclass(frozen=True, eq=False)
class Design:
    """Loop of a controller at the goal, and its largest pole along the move."""

    controller: Controller
    loop: Loop
    largest_pole: float
    """Largest magnitude of a discrete-time pole at POSES poses of the first move."""

    @property
    def stable(self) -> bool:
        """Whether the loop is stable at the goal and along the move."""
        return self.loop.stable and self.largest_pole <= 1.0 + 1e-9


@dataclass(frozen=True, eq=False)
class Study:
    """Simulated cases and their results."""

    boom: Boom
    setup: Setup
    rows: tuple[Row, ...]
    designs: tuple[Design, ...]
    modes_Hz: tuple[float, ...]
    """Natural frequencies at the goal; motors fixed, tangent stiffness under gravity."""
    gearbox_Hz: tuple[float, ...]
    """Natural frequencies with rigid links and gearboxes of stiffness K1, as estimated by hand."""
    impulses: tuple[Impulses, ...]
    """Impulses of each shaper."""
    run: Run
    tip_error: Array
    """(n, B) distance of the tip from its command [m]."""
    notes: tuple[str, ...]
    assumptions: tuple[str, ...]

    @property
    def failed(self) -> bool:
        """Whether any case failed."""
        return any(row.outcome in FAILED for row in self.rows)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reason for each case that does not follow its command."""
        return tuple(f"{row.profile}, {row.controller}, shaper {row.shaper}: {row.reason}" for row in self.rows if row.reason)

    @property
    def leading(self) -> tuple[Row, ...]:
        """Most relevant cases: up to six that failed, and the least RMS error of each profile.

        These are all cases if there are at most eight.
        """
        if len(self.rows) <= 8:
            return self.rows
        failed = [row for row in self.rows if row.outcome in FAILED][:6]
        following = [row for row in self.rows if row.outcome not in FAILED]
        best = [
            min((row for row in following if row.profile == profile), key=lambda row: row.tip_error_rms_m or np.inf)
            for profile in dict.fromkeys(row.profile for row in following)
        ]
        return (*failed, *best)

    @property
    def summary(self) -> str:
        """Number of cases with each outcome."""
        counts = {o: sum(row.outcome is o for row in self.rows) for o in Outcome}
        return "; ".join(f"{count} of {len(self.rows)} cases: {outcome}" for outcome, count in counts.items() if count)

    def to_json(self, files: dict[str, str]) -> dict[str, Any]:
        """Return the JSON object of `boom control`, in SI."""
        return {
            "ok": not self.failed,
            "cases": [asdict(row) for row in self.rows],
            "modes_Hz": list(self.modes_Hz),
            "gearbox_alone_Hz": list(self.gearbox_Hz),
            "designs": [
                {
                    "controller": design.controller,
                    "stable": design.stable,
                    "largest_sampled_pole": design.largest_pole,
                    "margins": [{**asdict(m), "joint": JOINTS[m.joint]} for m in design.loop.margins],
                    "poles_1_s": [[float(p.real), float(p.imag)] for p in design.loop.poles],
                }
                for design in self.designs
            ],
            "notes": list(self.notes),
            "assumptions": list(self.assumptions),
            "files": files,
        }

    def to_markdown(self) -> str:
        """Return the report as Markdown, in displayed units."""
        lines = [f"# {self.summary}", "", self.modes_sentence, ""]
        lines += [*table(ROW_HEADER, map(row_cells, self.rows)), "", ROW_LEGEND]
        if self.designs:
            lines += ["", "## Loops at the goal, each opened with the others closed", ""]
            lines += table(LOOP_HEADER, [cells for design in self.designs for cells in loop_cells(design)])
        for title, texts in (("Cases", self.reasons), ("Notes", self.notes), ("Assumed", self.assumptions)):
            lines += section(title, texts)
        return "\n".join(lines) + "\n"

    @property
    def modes_sentence(self) -> str:
        """Natural frequencies in a sentence."""
        if not self.modes_Hz:
            return "No joint is elastic, so there are no natural frequencies"
        shown, gears = (", ".join(f"{f:.2f}" for f in each) for each in (self.modes_Hz, self.gearbox_Hz))
        return f"Natural frequencies at the goal, motors fixed: {shown} Hz (rigid links, gearboxes of stiffness K1: {gears} Hz)"


def study(
    boom: Boom,
    moves: Sequence[Move],
    controllers: Sequence[Controller],
    shapers: Sequence[Shaper],
    setup: Setup | None = None,
    track: Track = iter,
) -> Study:
    """Simulate every move with every controller and shaper, and evaluate the tracking error.

    The shapers are designed for the lowest mode at the goal of the first move, with the motors
    fixed and the structural damping ratio.

    Args:
        boom: the boom that planning and controllers assume.
        moves: the planned moves.
        controllers: the controllers.
        shapers: the input shapers.
        setup: settings; None takes every default.
        track: iterates over the sampling periods, and may show progress.

    Raises:
        InputError: there is nothing to simulate, the payload is negative, the gust is outside the
            simulated time, or a shaper is given although no joint is elastic.
        InfeasibleError: as `natural_frequencies`.
    """
    setup = Setup() if setup is None else setup
    if not (moves and controllers and shapers):
        raise InputError("a study needs at least one move, one controller and one shaper")
    goal = moves[0].trajectory.q[-1]
    model = Plant.of(boom, setup.figures, elastic=setup.elastic, bending=setup.bending, backlash=setup.backlash, reference=goal)
    true = boom.with_payload(boom.payload.mass + setup.payload_error)
    plant = model.with_boom(true)
    modes, gearbox = _modes(plant, goal)
    if not modes and set(shapers) != {Shaper.NONE}:
        raise InputError("no joint is elastic, so an input shaper has no mode to suppress")
    shaped = {s: impulses(s, _modes(model, goal)[0][0] if modes else 1.0, setup.figures.structural_damping) for s in shapers}
    cases, names = [], []
    for move in moves:
        for shaper in shapers:
            command = Command.of(move, shaped[shaper])
            for controller in controllers:
                cases.append(Case.of(model, controller, setup.goals, command))
                names.append((str(move.profile), str(controller), str(shaper)))
    designs = [_design(plant, model, case) for case in cases[: len(controllers)] if case.controller is not Controller.STEPPER]
    hold = max(case.command.duration for case in cases) + setup.hold
    if setup.gust is not None and not (setup.gust.start >= 0.0 and setup.gust.start + setup.gust.duration <= hold):
        gust = setup.gust
        raise InputError(
            f"gust from {gust.start:g} s to {gust.start + gust.duration:g} s; it must lie within the simulated 0 to {hold:g} s"
        )
    run = simulate(
        plant,
        cases,
        hold,
        model=boom,
        vehicle=setup.vehicle,
        gust=setup.gust,
        compensate_sag=setup.compensate_sag,
        track=track,
    )
    off = forward_kinematics(boom, run.q).position - forward_kinematics(boom, run.command).position
    tip_error = np.linalg.norm(off, axis=-1)
    stable = {design.controller: design for design in designs}
    period = 1.0 / modes[0] if modes else None
    rows = tuple(
        _row(name, case, run, b, tip_error[:, b], off[:, b], period, stable.get(case.controller), setup)
        for b, (name, case) in enumerate(zip(names, cases, strict=True))
    )
    return Study(
        boom=true,
        setup=setup,
        rows=rows,
        designs=tuple(designs),
        modes_Hz=modes,
        gearbox_Hz=gearbox,
        impulses=tuple(shaped.values()),
        run=run,
        tip_error=tip_error,
        notes=_notes(plant, setup, controllers),
        assumptions=(*setup.figures.assumptions, *assumptions(boom, any(m.trajectory.qddd is not None for m in moves))),
    )


def _modes(plant: Plant, goal: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    if not plant.elastic:
        return (), ()
    rigid = replace(plant, bends=False)
    return tuple(map(float, natural_frequencies(plant, goal))), tuple(
        map(float, natural_frequencies(rigid, goal, plant.stiffness[:, 0]))
    )


def _design(plant: Plant, model: Plant, case: Case) -> Design:
    times = np.linspace(0.0, case.command.duration, POSES)
    along = [
        analyse(plant, case.gains_at(t), q, model=model, responses=False).largest
        for t, q in zip(times, case.command(times)[0], strict=True)
    ]
    loop = analyse(plant, case.gains[-1], case.gains[-1].at, model=model)
    return Design(case.controller, loop, max(along))


def _row(
    name: tuple[str, str, str],
    case: Case,
    run: Run,
    b: int,
    tip_error: Array,
    off: Array,
    period: float | None,
    design: Design | None,
    setup: Setup,
) -> Row:
    end, T = case.command.duration, float(run.t[1])
    error = run.q[:, b] - run.command[:, b]
    asked = np.abs(run.torque[:, b]) / run.limit[:, b]
    over = np.any(asked > 1.0, axis=1)
    lasted = run.t < (np.inf if np.isnan(run.ended[b]) else run.ended[b])
    saturated = 0.0 if case.controller is Controller.STEPPER else float(over[lasted].mean())
    outcome, reason = _outcome(run, b, design, saturated)
    during, after = run.t <= end + T / 2.0, run.t >= end - T / 2.0
    sound = bool(np.isnan(run.ended[b]))
    last = max(int(np.ceil((period or 0.25) / T)), 1)
    rest = off[-last:].mean(axis=0)
    away = np.linalg.norm(off[after] - rest, axis=-1) > setup.settled
    settling = None
    if not away[-1]:
        settling = float(T * (np.flatnonzero(away)[-1] + 1)) if away.any() else 0.0
    return Row(
        *name,
        duration_s=end,
        outcome=outcome,
        reason=reason,
        tip_error_peak_m=float(tip_error.max()) if sound else None,
        tip_error_rms_m=float(np.sqrt(np.mean(tip_error[during] ** 2))) if sound else None,
        tip_error_end_m=float(np.linalg.norm(rest)) if sound else None,
        joint_error_peak=tuple(np.abs(error).max(axis=0).tolist()) if sound else None,
        joint_error_rms=tuple(np.sqrt(np.mean(error[during] ** 2, axis=0)).tolist()) if sound else None,
        overshoot=_overshoot(run.q[:, b], run.command[:, b], last) if sound else None,
        settling_s=settling if sound else None,
        residual_vibration_m=_residual(off[after], last) if sound and period is not None else None,
        peak_torque_ratio=float(asked.max()) if sound and np.isfinite(run.limit[:, b]).any() else None,
        saturated_share=saturated,
    )


def _outcome(run: Run, b: int, design: Design | None, saturated: float) -> tuple[Outcome, str]:
    lost = run.lost[b]
    if not np.isnan(lost).all():
        i = int(np.nanargmin(lost))
        return Outcome.LOST_STEP, f"{JOINTS[i]}: the motor loses its first step at {lost[i]:.3f} s"
    if not np.isnan(run.ended[b]):
        reason = f"diverges at {run.ended[b]:.3f} s"
        return Outcome.UNSTABLE, reason + (f", with a motor saturated for {saturated:.1%} of the time" if saturated else "")
    if design is not None and not design.stable:
        return (
            Outcome.UNSTABLE,
            f"discrete-time pole of magnitude {max(design.largest_pole, design.loop.largest):.6f} along the move",
        )
    if saturated > 0.0:
        i = int((np.abs(run.torque[:, b]) / run.limit[:, b]).max(axis=0).argmax())
        return Outcome.SATURATES, f"{JOINTS[i]}: the motor is saturated for {saturated:.1%} of the time"
    return Outcome.FOLLOWS, ""


def _overshoot(q: Array, command: Array, last: int) -> float:
    way = command[-1] - command[0]
    moves = np.abs(way) > 1e-6
    if not moves.any():
        return 0.0
    beyond = (q - q[-last:].mean(axis=0))[:, moves] / way[moves]
    return float(max(beyond.max(), 0.0))


def _residual(off: Array, window: int) -> float:
    """Return the largest |off - moving mean of off|, off (n, 3). The mean removes slow creep."""
    if len(off) <= window:
        return 0.0
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(off, axis=0)])
    means = (sums[window:] - sums[:-window]) / window
    middle = off[window // 2 : window // 2 + len(means)]
    return float(np.linalg.norm(middle - means, axis=-1).max())


def _notes(plant: Plant, setup: Setup, controllers: Sequence[Controller]) -> tuple[str, ...]:
    notes = [*plant.limits]
    given = [f"{name} {getattr(setup.figures, name):g}" for name in setup.figures.given]
    if given:
        notes.append(f"given: {', '.join(given)}")
    if plant.bends and plant.elastic:
        notes.append(
            "inner link and extension bend in the arm's plane, as torsional springs behind the gearboxes; they are rigid "
            "sideways, and the other links and the pins are rigid"
        )
    if plant.elastic and not plant.gap.any():
        notes.append("backlash and hysteresis of the gearboxes are left out")
    elif plant.elastic:
        notes.append("hysteresis of the gearboxes is left out")
    if setup.payload_error:
        assumed = plant.boom.payload.mass - setup.payload_error
        notes.append(f"the true payload is {plant.boom.payload.mass:g} kg; planning and controllers assume {assumed:g} kg")
    if setup.vehicle is not None:
        notes.append(f"{setup.vehicle.sentence}; the controllers know the slope only")
    if setup.gust is not None:
        gust = setup.gust
        notes.append(f"gust on the tip: at most {gust.force} N, from {gust.start:g} s for {gust.duration:g} s (given)")
    goals = setup.goals
    if set(controllers) != {Controller.STEPPER}:
        notes.append(
            f"loops designed for poles at {goals.bandwidth_Hz:g} Hz with damping {goals.damping:g}, "
            f"integral action at {goals.integral:g} times this frequency"
        )
    if setup.compensate_sag:
        notes.append("the motor references compensate the twist under the assumed weight")
    if Controller.STEPPER in controllers:
        notes.append("stepper: open loop without margins; joints without a drive use pd with full feedforward")
    return tuple(notes)


ROW_HEADER = (
    "profile",
    "controller",
    "shaper",
    "time s",
    "tip mm",
    "rms mm",
    "rest mm",
    "vibr. mm",
    "over",
    "settles s",
    "torque",
    "outcome",
)

LOOP_HEADER = ("controller", "joint", "gain margin dB", "less gain dB", "phase margin deg", "at Hz", "max |S|")


ROW_LEGEND = (
    "tip, rms, rest: largest tip error, RMS until the end of the command, and error at rest (sag); vibr.: residual "
    "vibration after the end of the command; over: largest overshoot of a joint; settles: time from the end of the command; "
    "torque: largest torque command divided by the motor's torque at its speed, if known"
)


def row_cells(row: Row) -> tuple[str, ...]:
    """Return a case as text, in the columns of ROW_HEADER."""
    millimetres = (row.tip_error_peak_m, row.tip_error_rms_m, row.tip_error_end_m, row.residual_vibration_m)
    return (
        row.profile,
        row.controller,
        row.shaper,
        f"{row.duration_s:.2f}",
        *("-" if value is None else f"{1e3 * value:.2f}" for value in millimetres),
        "-" if row.overshoot is None else f"{row.overshoot:.2%}",
        "-" if row.settling_s is None else f"{row.settling_s:.2f}",
        "-" if row.peak_torque_ratio is None else f"{row.peak_torque_ratio:.2f}",
        str(row.outcome),
    )


def loop_cells(design: Design) -> list[tuple[str, ...]]:
    """Return the loops of a controller as text, in the columns of LOOP_HEADER."""

    def shown(value: float | None, digits: int = 1) -> str:
        return "-" if value is None else f"{value:.{digits}f}"

    return [
        (
            design.controller,
            JOINTS[m.joint],
            shown(m.gain_dB),
            shown(m.less_gain_dB),
            shown(m.phase_deg),
            shown(m.crossover_Hz, 2),
            shown(m.sensitivity_peak, 2),
        )
        for m in design.loop.margins
    ]
