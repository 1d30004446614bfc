"""A motion's report: its rows, what was assumed, and the verdict."""

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from boom_model import JOINTS, Basis, Boom, Breakdown
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from planner.checks.certificate import Certificate
from planner.checks.kinds import Margin
from planner.checks.rows import Row, Verdict, overall
from planner.checks.stopping import WorstStop
from planner.reports.markdown import section, table
from planner.timing.worst_ratios import WorstRatio

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class TorquePeak:
    """The largest torque of a joint and its parts, in Nm (N for the extension); the parts add up to the total."""

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
    """The largest torque of each joint, in parts.

    Args:
        at: (5,) time of each joint's peak.
        parts: (5, 5) at those times; the diagonal is each joint's own.
    """
    total = parts.total
    peaks = []
    for i, joint in enumerate(JOINTS):
        shares = {field.name: float(getattr(parts, field.name)[i, i]) for field in fields(parts)}
        peaks.append(TorquePeak(joint=joint, unit=LOAD_UNITS[i], at_s=float(at[i]), total=float(total[i, i]), **shares))
    return tuple(peaks)


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """What was checked, and what came of it."""

    profile: str
    duration: float
    """[s]"""
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    """What a reader must know of the motion or its data."""
    assumptions: tuple[str, ...]
    """Every assumed figure of the boom that the checks or the planner use."""
    peaks: tuple[TorquePeak, ...] = ()
    """Where each joint's largest torque comes from."""
    certificate: Certificate | None = None
    """Of a planned motion: the worst ratio to each limit, recomputed; None of a recorded one."""
    stop: WorstStop | None = None
    """Of a planned motion: the longest and the farthest stop on its way."""
    suggestions: tuple[str, ...] = ()
    """Single changes that would make a failing motion possible, as far as they were looked for."""

    @property
    def verdict(self) -> Verdict:
        """FAIL where a row fails or the certificate finds a limit broken, else that of the rows."""
        return Verdict.FAIL if self.certificate is not None and self.certificate.broken else overall(self.rows)

    def verdict_of(self, joint: str) -> Verdict:
        """The verdict of one joint's rows and of the certificate's limits on it."""
        broken = self.certificate is not None and any(worst.joint == joint for worst in self.certificate.broken)
        return Verdict.FAIL if broken else overall(row for row in self.rows if row.joint == joint)

    @property
    def summary(self) -> str:
        """The verdict in a sentence, with what decides it."""
        failed = [f"{r.joint} {r.check}" for r in self.rows if r.verdict is Verdict.FAIL]
        unknown = list(dict.fromkeys(r.joint for r in self.rows if r.verdict is Verdict.NOT_CHECKABLE))
        warned = [f"{r.joint} {r.check}" for r in self.rows if r.verdict is Verdict.WARN]
        if self.certificate is not None:
            failed += [f"{worst.joint} {worst.limit} (certificate)" for worst in self.certificate.broken]
        parts = [f"failed: {', '.join(failed)}"] if failed else []
        parts += [f"passed only on estimated or assumed data: {', '.join(warned)}"] if warned else []
        parts += [f"not checkable for want of data: {', '.join(unknown)}"] if unknown else []
        return f"{self.verdict}: {'; '.join(parts) if parts else 'every check passed'}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """What certificate and stop say, for people."""
        said = []
        if self.certificate is not None:
            of, more = self.certificate, f"one more could add {self.certificate.residual:.0e} of a limit"
            said.append(f"Certificate: recomputed at {of.samples} points; {of.iterations} solve(s), {more}")
        if self.stop is not None:
            said.append(
                f"Stopping: at worst {self.stop.time_s:.2f} s ({self.stop.time_way}, begun at {self.stop.time_at_s:.2f} s) and "
                f"{self.stop.distance_m:.2f} m of the tip ({self.stop.distance_way}, begun at {self.stop.distance_at_s:.2f} s)"
            )
        return tuple(said)

    def to_json(self, files: dict[str, str]) -> dict[str, Any]:
        """The JSON object of `boom plan` and `boom check`, in SI."""
        return {
            "profile": self.profile,
            "duration_s": self.duration,
            "verdict": self.verdict,
            "checks": [row.to_json() for row in self.rows],
            "notes": list(self.notes),
            "assumptions": list(self.assumptions),
            "torque_peaks": [asdict(peak) for peak in self.peaks],
            "certificate": None if self.certificate is None else asdict(self.certificate),
            "stop": None if self.stop is None else asdict(self.stop),
            "remedies": list(self.suggestions),
            "files": files,
        }

    def to_table(self) -> "pa.Table":
        """The rows as a table in SI, with the columns of the JSON's checks."""
        import pyarrow as pa

        texts, numbers = ("joint", "check", "unit", "verdict", "basis", "source"), ("demand", "limit", "margin")
        types = dict.fromkeys(texts, pa.string()) | dict.fromkeys((*numbers, "required_margin", "at_s"), pa.float64())
        order = ("joint", "check", *numbers[:2], "unit", "margin", "required_margin", "at_s", "verdict", "basis", "source")
        return pa.Table.from_pylist([row.to_json() for row in self.rows], schema=pa.schema([(n, types[n]) for n in order]))

    def __repr__(self) -> str:
        return f"Report({self.profile}, {self.duration:.3f} s, {len(self.rows)} rows, {self.verdict})"

    def to_markdown(self) -> str:
        """The report as Markdown, in people's units."""
        header = ("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis", "source")
        lines = [f"# {self.summary}", "", f"{self.profile}, {self.duration:.3f} s", ""]
        lines += table(header, [(*cells(row), row.source) for row in self.rows])
        if self.peaks:
            lines += ["", "## Largest torques and where they come from", "", *table(PEAK_HEADER, map(peak_cells, self.peaks))]
        if self.certificate is not None:
            lines += ["", "## Certificate", "", *table(CERTIFICATE_HEADER, map(worst_cells, self.certificate.worst))]
        lines += [f"\n{sentence}" for sentence in self.sentences]
        for title, texts in (("Would mend it", self.suggestions), ("Notes", self.notes), ("Assumed", self.assumptions)):
            lines += section(title, texts)
        return "\n".join(lines) + "\n"


def cells(row: Row) -> tuple[str, ...]:
    """A row for people: joint, check, demand, limit, margin, required margin, time, verdict, basis."""
    factor, unit = row.shown_unit.per_si, row.shown_unit.name
    if row.margin is None:
        margin = "-"
    elif row.kind.margin is Margin.DISTANCE:
        margin = f"{row.margin * factor:.4g} {unit}"
    else:
        margin = f"{round(row.margin, 2) + 0.0:.0%}"  # no -0%
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
    """Four digits, and no power of ten below a million million."""
    return f"{float(f'{value:.4g}'):.12g}"


ROW_HEADER = ("joint", "check", "demand", "limit", "margin", "required", "at", "verdict", "basis")

CERTIFICATE_HEADER = ("limit", "joint", "worst ratio", "at")


def worst_cells(worst: WorstRatio) -> tuple[str, ...]:
    """A certificate's worst ratio for people, under CERTIFICATE_HEADER."""
    return (worst.limit, worst.joint, f"{worst.ratio:.4f}", "-" if worst.at_s is None else f"{worst.at_s:.2f} s")


PEAK_HEADER = ("joint", "at", "total", "gravity", "inertia", "velocity", "payload", "friction", "vehicle")


def peak_cells(peak: TorquePeak) -> tuple[str, ...]:
    """A torque peak for people, under PEAK_HEADER."""
    parts = (peak.gravity, peak.inertia, peak.velocity, peak.payload, peak.friction, peak.vehicle)
    return (peak.joint, f"{peak.at_s:.2f} s", f"{peak.total:.2f} {peak.unit}", *(f"{part:.2f}" for part in parts))


def assumptions(boom: Boom, jerk_limited: bool) -> tuple[str, ...]:
    """Every assumed figure of a boom, a sentence each; the jerk limits only where a motion was planned with them."""
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
    for name, bearable in (("force", boom.mount.force), ("moment", boom.mount.moment)):
        if bearable is not None and bearable.origin.basis is Basis.ASSUMED:
            sentences.append(f"{name} that the mount bears, {bearable.value:g}: {bearable.origin.source}")
    keep = boom.keep_out
    if keep is not None:
        if keep.origin.basis is Basis.ASSUMED:
            lengths = (
                f"clearance {keep.clearance:g} m, radius of links {keep.link_radius:g} m, of payload {keep.payload_radius:g} m"
            )
            sentences.append(f"{lengths}: {keep.origin.source}")
        assumed = [shape for shape in keep.shapes if shape.origin.basis is Basis.ASSUMED]
        sentences += [f"{shape.name} to keep away from: {shape.origin.source}" for shape in assumed]
    if limits.origins["transmission"][0].basis is Basis.ASSUMED:
        angle = np.degrees(limits.transmission)
        sentences.append(f"transmission angle warned of below {angle:g} deg: {limits.origins['transmission'][0].source}")
    return tuple(sentences)
