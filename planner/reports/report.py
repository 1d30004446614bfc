"""Report of a motion: rows, assumptions and verdict."""

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import JOINTS, Basis, Boom, Breakdown
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from planner.checks.certificate import Certificate
from planner.checks.energy import ENERGY_HEADER, Energy, energy_cells
from planner.checks.kinds import Margin
from planner.checks.rows import Row, Verdict, overall
from planner.checks.stopping import WorstStop
from planner.reports.markdown import section, table
from planner.timing.worst_ratios import WorstRatio

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class TorquePeak:
    """Largest torque of a joint and its parts, in Nm (N for the extension).

    The parts add up to the total.
    """

    joint: str
    unit: str
    at_s: float
    gravity: float
    inertia: float
    velocity: float
    payload: float
    friction: float
    vehicle: float
    total: float


def torque_peaks(at: Array, parts: Breakdown) -> tuple[TorquePeak, ...]:
    """Return the largest torque of each joint and its parts.

    Args:
        at: (5,) time of each joint's largest torque [s].
        parts: (5, 5) parts of the torques of all joints at those times.
    """
    total = parts.total
    peaks = []
    for i, joint in enumerate(JOINTS):
        shares = {field.name: float(getattr(parts, field.name)[i, i]) for field in fields(parts)}
        peaks.append(TorquePeak(joint=joint, unit=LOAD_UNITS[i], at_s=float(at[i]), total=float(total[i, i]), **shares))
    return tuple(peaks)


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """Checks of a motion and their results."""

    profile: str
    duration: float
    """Duration [s]."""
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    """Remarks on the motion or its data."""
    assumptions: tuple[str, ...]
    """Assumed figures of the boom that the checks or the planner use."""
    peaks: tuple[TorquePeak, ...] = ()
    """Largest torque of each joint and its parts."""
    certificate: Certificate | None = None
    """Recomputed worst ratio to each limit of a planned motion; None for a recorded one."""
    stop: WorstStop | None = None
    """Longest and farthest stop on the way of a planned motion; None if not computed."""
    energy: Energy | None = None
    """Power and energy; None if not computed."""
    suggestions: tuple[str, ...] = ()
    """Single changes that make a failing motion possible; empty if none were searched."""
    measured: tuple[str, ...] = ()
    """What of the boom was measured on the machine, with the log."""

    @property
    def verdict(self) -> Verdict:
        """FAIL if the certificate finds a limit exceeded, else the verdict of the rows."""
        return Verdict.FAIL if self.certificate is not None and self.certificate.broken else overall(self.rows)

    def verdict_of(self, joint: str) -> Verdict:
        """Return the verdict of one joint, from its rows and its ratios in the certificate."""
        broken = self.certificate is not None and any(worst.joint == joint for worst in self.certificate.broken)
        return Verdict.FAIL if broken else overall(row for row in self.rows if row.joint == joint)

    @property
    def summary(self) -> str:
        """Verdict in a sentence, with the checks that decide it."""
        failed = [f"{r.joint} {r.check}" for r in self.rows if r.verdict is Verdict.FAIL]
        unknown = list(dict.fromkeys(r.joint for r in self.rows if r.verdict is Verdict.NOT_CHECKABLE))
        warned = [f"{r.joint} {r.check}" for r in self.rows if r.verdict is Verdict.WARN]
        if self.certificate is not None:
            failed += [f"{worst.joint} {worst.limit} (certificate)" for worst in self.certificate.broken]
        parts = [f"failed: {', '.join(failed)}"] if failed else []
        parts += [f"passed only on estimated or assumed data: {', '.join(warned)}"] if warned else []
        parts += [f"not checkable because data is missing: {', '.join(unknown)}"] if unknown else []
        return f"{self.verdict}: {'; '.join(parts) if parts else 'every check passed'}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """Certificate and worst stop, in a sentence each."""
        sentences = []
        if self.certificate is not None:
            certificate = self.certificate
            sentences.append(
                f"Certificate: recomputed at {certificate.samples} points; {certificate.iterations} solve(s), "
                f"one more could change a ratio by {certificate.residual:.0e}"
            )
        if self.stop is not None:
            sentences.append(
                f"Stopping: at worst {self.stop.time_s:.2f} s ({self.stop.time_way}, from {self.stop.time_at_s:.2f} s) and "
                f"{self.stop.distance_m:.2f} m of the tip ({self.stop.distance_way}, from {self.stop.distance_at_s:.2f} s)"
            )
        return tuple(sentences)

    def to_json(self, files: dict[str, str]) -> dict[str, Any]:
        """Return the JSON object of `boom plan` and `boom check`, in SI."""
        return {
            "profile": self.profile,
            "duration_s": self.duration,
            "verdict": self.verdict,
            "checks": [row.to_json() for row in self.rows],
            "notes": list(self.notes),
            "assumptions": list(self.assumptions),
            "measured": list(self.measured),
            "torque_peaks": [asdict(peak) for peak in self.peaks],
            "certificate": None if self.certificate is None else asdict(self.certificate),
            "stop": None if self.stop is None else asdict(self.stop),
            "energy": None if self.energy is None else self.energy.to_json(),
            "remedies": list(self.suggestions),
            "files": files,
        }

    def to_table(self) -> "pa.Table":
        """Return the rows as a table in SI, with the columns of the JSON's checks."""
        import pyarrow as pa

        texts, numbers = ("joint", "check", "unit", "verdict", "basis", "source"), ("demand", "limit", "margin")
        types = dict.fromkeys(texts, pa.string()) | dict.fromkeys((*numbers, "required_margin", "at_s"), pa.float64())
        order = ("joint", "check", *numbers[:2], "unit", "margin", "required_margin", "at_s", "verdict", "basis", "source")
        return pa.Table.from_pylist([row.to_json() for row in self.rows], schema=pa.schema([(n, types[n]) for n in order]))

    def __repr__(self) -> str:
        return f"Report({self.profile}, {self.duration:.3f} s, {len(self.rows)} rows, {self.verdict})"

    def to_markdown(self) -> str:
        """Return the report as Markdown, in displayed units."""
        return f"# {self.summary}\n\n{self.profile}, {self.duration:.3f} s\n{self.details()}"

    def details(self) -> str:
        """Return all but the title: peaks, certificate, notes, every check and assumption."""
        header = ("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis", "source")
        lines = []
        if self.peaks:
            lines += ["", "## Largest torques and where they come from", "", *table(PEAK_HEADER, map(peak_cells, self.peaks))]
        if self.energy is not None:
            lines += ["", "## Power and energy", "", *table(ENERGY_HEADER, map(energy_cells, self.energy.joints))]
            lines += [f"\n{sentence}" for sentence in self.energy.sentences]
        if self.certificate is not None:
            lines += ["", "## Certificate", "", *table(CERTIFICATE_HEADER, map(worst_cells, self.certificate.worst))]
        lines += [f"\n{sentence}" for sentence in self.sentences]
        lines += [*section("Possible fixes", self.suggestions), *section("Notes", self.notes)]
        lines += ["", "## Every check", "", *table(header, [(*cells(row), row.source) for row in self.rows])]
        return "\n".join([*lines, *section("Measured", self.measured), *section("Assumed", self.assumptions)]) + "\n"


def cells(row: Row) -> tuple[str, ...]:
    """Return a row as text in displayed units, in the columns of ROW_HEADER."""
    factor, unit = row.shown_unit.per_si, row.shown_unit.name
    if row.margin is None:
        margin = "-"
    elif row.kind.margin is Margin.DISTANCE:
        margin = f"{row.margin * factor:.4g} {unit}"
    else:
        margin = f"{round(row.margin, 2) + 0.0:.0%}"  # turns -0% into 0%
    return (
        row.joint,
        row.check,
        "-" if row.demand is None else f"{_rounded(row.demand * factor)} {unit}".rstrip(),
        "-" if row.limit is None else f"{_rounded(row.limit * factor)} {unit}".rstrip(),
        margin,
        "-" if row.verdict is Verdict.INFO else f"{row.required_margin:.0%}",
        "-" if row.at_s is None else f"{row.at_s:.2f} s",
        row.verdict,
        row.basis or "-",
    )


def _rounded(value: float) -> str:
    """Return four significant digits, without an exponent below 1e12."""
    return f"{float(f'{value:.4g}'):.12g}"


ROW_HEADER = ("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis")

CERTIFICATE_HEADER = ("limit", "joint", "worst ratio", "at")


def worst_cells(worst: WorstRatio) -> tuple[str, ...]:
    """Return a worst ratio as text, in the columns of CERTIFICATE_HEADER."""
    return (worst.limit, worst.joint, f"{worst.ratio:.4f}", "-" if worst.at_s is None else f"{worst.at_s:.2f} s")


PEAK_HEADER = ("joint", "at", "total", "gravity", "inertia", "velocity", "payload", "friction", "vehicle")


def peak_cells(peak: TorquePeak) -> tuple[str, ...]:
    """Return a torque peak as text, in the columns of PEAK_HEADER."""
    parts = (peak.gravity, peak.inertia, peak.velocity, peak.payload, peak.friction, peak.vehicle)
    return (peak.joint, f"{peak.at_s:.2f} s", f"{peak.total:.2f} {peak.unit}", *(f"{part:.2f}" for part in parts))


def assumptions(boom: Boom, jerk_limited: bool) -> tuple[str, ...]:
    """Return a sentence for every assumed figure of a boom.

    Args:
        boom: the boom.
        jerk_limited: whether to include the jerk limits, which not every motion uses.
    """
    limits = boom.limits
    sentences = []
    for power, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
        if name == "jerk" and not jerk_limited:
            continue
        values: Array = getattr(limits, name)
        for i, origin in enumerate(limits.origins[name]):
            if origin.basis is Basis.ASSUMED:
                per = "/s" if power == 1 else f"/s^{power}"
                value = f"{values[i]:g} m{per}" if IS_LENGTH[i] else f"{np.degrees(values[i]):g} deg{per}"
                sentences.append(f"{JOINTS[i]} {name} limit {value}: {origin.source}")
    for joint, drive in zip(JOINTS, boom.drives, strict=True):
        if drive is None:
            continue
        voltage, wiring, brake = drive.bus_voltage, drive.wiring, drive.brake
        if voltage is not None and voltage.origin.basis is Basis.ASSUMED:
            sentences.append(f"{joint} bus voltage {voltage.value:g} V: {voltage.origin.source}")
        if wiring is not None and wiring.origin.basis is Basis.ASSUMED:
            sentences.append(f"{joint} wiring {wiring.value}: {wiring.origin.source}")
        if brake is not None and brake.origin.basis is Basis.ASSUMED:
            sentences.append(f"{joint} brake {'present' if brake.value else 'absent'}: {brake.origin.source}")
    for joint, given in zip(JOINTS, boom.friction.origins, strict=True):
        if given is not None and given.basis is Basis.ASSUMED:
            sentences.append(f"{joint} friction: {given.source}")
    for i, origin in enumerate(limits.origins["position"]):
        if origin.basis is Basis.ASSUMED:
            sentences.append(f"{JOINTS[i]} position limits: {origin.source}")
    if limits.origins["linkage"][0].basis is Basis.ASSUMED:
        sentences.append(f"coupled limit of the linkage: {limits.origins['linkage'][0].source}")
    for name, bearable, unit in (("force", boom.mount.force, "N"), ("moment", boom.mount.moment, "Nm")):
        if bearable is not None and bearable.origin.basis is Basis.ASSUMED:
            sentences.append(f"largest {name} on the mount {bearable.value:g} {unit}: {bearable.origin.source}")
    keep = boom.keep_out
    if keep is not None:
        if keep.origin.basis is Basis.ASSUMED:
            radii = f"radius of links {keep.link_radius:g} m and of payload {keep.payload_radius:g} m"
            sentences.append(f"clearance {keep.clearance:g} m, {radii}: {keep.origin.source}")
        assumed = [shape for shape in keep.shapes if shape.origin.basis is Basis.ASSUMED]
        sentences += [f"keep-out shape {shape.name}: {shape.origin.source}" for shape in assumed]
    if limits.origins["transmission"][0].basis is Basis.ASSUMED:
        angle = np.degrees(limits.transmission)
        sentences.append(f"guideline for the transmission angle {angle:g} deg: {limits.origins['transmission'][0].source}")
    return tuple(sentences)
