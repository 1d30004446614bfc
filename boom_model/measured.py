"""What of a boom was measured on the machine itself, by which log."""

from collections.abc import Iterator

from boom_model.boom import JOINTS, Boom
from boom_model.provenance import Basis, Origin

_GEOMETRY = "lengths and zeros of the joints"


def measured_figures(boom: Boom) -> tuple[tuple[str, str], ...]:
    """Return what was measured, with its source; empty for a boom as it was designed."""
    found: dict[tuple[str, str], list[str]] = {}
    for kind, name, origin in _origins(boom):
        if origin is not None and origin.basis is Basis.MEASURED:
            log = origin.source if kind == _GEOMETRY else origin.source.partition(": ")[0]
            found.setdefault((kind, log), []).append(name)
    every = {"masses": len(boom.bodies), "friction": len(JOINTS), "drive inertia": len(JOINTS)}
    return tuple(
        (kind if len(names) >= every.get(kind, 1) else f"{kind} of {', '.join(names)}", source)
        for (kind, source), names in found.items()
    )


def measured_lines(boom: Boom) -> tuple[str, ...]:
    """Return a sentence for each log: what it has measured."""
    by_log: dict[str, list[str]] = {}
    for what, source in measured_figures(boom):
        by_log.setdefault(source, []).append(what)
    return tuple(f"{', '.join(what)}: {source}" for source, what in by_log.items())


def _origins(boom: Boom) -> Iterator[tuple[str, str, Origin | None]]:
    if boom.calibration is not None:
        yield _GEOMETRY, "", boom.calibration.origin
    for name, body in boom.bodies.items():
        yield "masses", name, body.origin
    yield "payload", "", boom.payload.origin
    for joint, origin in zip(JOINTS, boom.friction.origins, strict=True):
        yield "friction", joint, origin
    for joint, drive, rotor in zip(JOINTS, boom.drives, boom.rotors, strict=True):
        inertia = rotor if drive is None else drive.inertia
        yield "drive inertia", joint, None if inertia is None else inertia.origin
