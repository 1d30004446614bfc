"""The file of an identified boom: measured bodies and friction, everything else as it was."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from boom_model import JOINTS, Body, Boom, Sourced
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH
from boom_model.boom_file import BOOM_FILE
from boom_model.toml_file import editable_toml
from planner.experiments.identification import Identification
from planner.experiments.unknowns import IDENTIFIED_BODIES
from planner.files import replacing

if TYPE_CHECKING:
    from tomlkit.items import InlineTable

_INERTIA = "inertia_kg_m2"


def write_identified(path: str | Path, source: str | Path | None, found: Identification, logs: str) -> None:
    """Write a boom's TOML file with the identified bodies, friction and drive inertia.

    Their basis is `measured`. Comments stay.

    Args:
        path: the file to write.
        source: the boom's file; None is the shipped one.
        found: what was identified.
        logs: names of the logs, for the source of each figure.

    Raises:
        InputError: a file cannot be read or written; an old one is left as it was.
    """
    deviations = found.deviations
    bodies = {}
    for k, name in enumerate(IDENTIFIED_BODIES):
        mass = deviations[10 * k]
        bodies[name] = (
            f"boom identify {logs}: mass to {mass:.2g} kg; torques tell combinations, the split is nearest to the CAD"
        )
    friction = {
        joint: f"boom identify {logs}: viscous to {deviations[75 + i]:.2g}, coulomb to {deviations[80 + i]:.2g}, "
        f"asymmetric to {deviations[85 + i]:.2g}"
        for i, joint in enumerate(JOINTS)
    }
    rotors = {}
    if found.drive_inertia is not None:
        known = zip(JOINTS, found.boom.drives, found.boom.rotors, strict=True)
        rotors = {joint: rotor if drive is None else drive.inertia for joint, drive, rotor in known}
    _write(path, source, found.boom, bodies, friction, None, {joint: (r, logs) for joint, r in rotors.items() if r is not None})


def write_payload(path: str | Path, source: str | Path | None, boom: Boom, why: str) -> None:
    """Write a boom's TOML file with another payload, basis measured.

    Raises:
        InputError: as `write_identified`.
    """
    _write(path, source, boom, {}, {}, why)


def _write(
    path: str | Path,
    source: str | Path | None,
    boom: Boom,
    bodies: dict[str, str],
    friction: dict[str, str],
    payload: str | None,
    rotors: Mapping[str, tuple[Sourced[float], str]] = MappingProxyType({}),
) -> None:
    import tomlkit

    document = editable_toml(BOOM_FILE if source is None else Path(source))
    for name, why in bodies.items():
        document["bodies"][name].update(_body_table(boom.bodies[name]) | {"basis": "measured", "source": why})
    if payload is not None:
        document["payload"].update(_body_table(boom.payload) | {"basis": "measured", "source": payload})
    for i, joint in enumerate(JOINTS):
        if joint in friction:
            document["joints"][joint]["friction"] = _friction_table(boom, i, friction[joint])
        if joint in rotors:
            key = f"drive_inertia_{'kg' if IS_LENGTH[i] else 'kg_m2'}"
            document["joints"][joint][key] = _rotor_table(*rotors[joint])
    with replacing(path) as temporary:
        Path(temporary).write_text(tomlkit.dumps(document), encoding="utf-8")


def _body_table(body: Body) -> dict[str, object]:
    inertia: Array = (body.inertia + body.inertia.T) / 2.0
    return {
        "mass_kg": _digits(body.mass),
        "com_m": [_digits(x) for x in body.com],
        _INERTIA: [[_digits(x) for x in row] for row in inertia],
    }


def _friction_table(boom: Boom, joint: int, why: str) -> dict[str, object]:
    viscous, dry = ("viscous_N_s_per_m", "N") if IS_LENGTH[joint] else ("viscous_Nm_s_per_rad", "Nm")
    friction = boom.friction
    coulomb = _digits(friction.coulomb[joint])
    return {
        viscous: _digits(friction.viscous[joint]),
        f"coulomb_{dry}": coulomb,
        f"asymmetric_{dry}": float(np.clip(_digits(friction.asymmetric[joint]), -coulomb, coulomb)),
        "basis": "measured",
        "source": why,
    }


def _rotor_table(inertia: Sourced[float], logs: str) -> "InlineTable":
    import tomlkit

    table = tomlkit.inline_table()
    table.update({"value": _digits(inertia.value), "basis": str(inertia.origin.basis)})
    table["source"] = f"boom identify {logs}: {inertia.origin.source}"
    return table


def _digits(value: float) -> float:
    """Return the number with ten significant digits.

    With fewer, a thin body's inertia may become one that no solid has.
    """
    return float(f"{value:.10g}")
