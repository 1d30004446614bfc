"""The boom's file with what a calibration has measured; the rest, comments included, stays."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.items import Table

from boom_model import JOINTS, Boom, InputError
from boom_model.boom import IS_LENGTH
from boom_model.boom_file import BOOM_FILE
from boom_model.calibration import INNER, LENGTHS, UPPER
from boom_model.toml_file import editable_toml
from planner.experiments.calibration import Calibrated
from planner.files import replacing

_DIGITS = 10
_LAST_LENGTH = re.compile(r"^L8_m\b.*$", re.MULTILINE)


def write_calibrated(found: Calibrated, path: str | Path, boom_file: str | Path | None, catalogue: str | Path | None) -> None:
    """Write the calibrated boom as TOML, from the file that it came from.

    Args:
        found: the calibration.
        path: file to write.
        boom_file: file of the boom before; None is the shipped one.
        catalogue: as in `Boom.load`.

    Raises:
        InputError: a file cannot be read or written.
    """
    source = BOOM_FILE if boom_file is None else Path(boom_file)
    document = editable_toml(source)
    _write_lengths(document["geometry"], found)
    document.pop("calibration", None)
    document["calibration"] = _calibration(found)
    text = tomlkit.dumps(document)
    if found.unequal:
        lines, place = _unequal_lines(found), _LAST_LENGTH.search(text)
        if place is None:
            raise InputError(f"{source}: [geometry] must hold L8_m on a line of its own to take up L5_m and L9_m")
        text = text[: place.end()] + "".join(f"\n{line}" for line in lines) + text[place.end() :]
    with replacing(path) as temporary:
        Path(temporary).write_text(text, encoding="utf-8")
        Boom.load(temporary, catalogue)  # what is written can be read


def _write_lengths(table: Any, found: Calibrated) -> None:
    g, sds = found.boom.geometry, {p.name: p.sd for p in found.parameters}
    for name in LENGTHS:
        key, sd = f"{name}_m", sds.get(name)
        if name not in (UPPER, INNER) and sd is not None:
            table[key] = round(getattr(g, name), _DIGITS)
            table[key].comment(f"measured: standard deviation {sd * 1e3:.3g} mm")
    for key in ("L5_m", "L9_m"):
        table.pop(key, None)


def _unequal_lines(found: Calibrated) -> list[str]:
    g, sds = found.boom.geometry, {p.name: p.sd for p in found.parameters}
    lines = []
    for key, name, value in (("L5_m", UPPER, g.L5), ("L9_m", INNER, g.L9)):
        sd = sds.get(name)
        said = "" if sd is None else f"  # measured: {name} has a standard deviation of {sd * 1e3:.3g} mm"
        lines.append(f"{key} = {round(value, _DIGITS)!r}{said}")
    return lines


def _calibration(found: Calibrated) -> Table:
    known = found.boom.calibration
    assert known is not None
    table = tomlkit.table()
    table.comment("joint position = scale * reading + offset")
    table["basis"], table["source"] = str(known.origin.basis), known.origin.source
    offset, shares = tomlkit.inline_table(), tomlkit.inline_table()
    for i, joint in enumerate(JOINTS):
        value = known.offset[i] if IS_LENGTH[i] else np.degrees(known.offset[i])
        offset[f"{joint}_{'m' if IS_LENGTH[i] else 'deg'}"] = round(float(value), _DIGITS)
        if known.wind_up[i] != 1.0:
            shares[joint] = round(float(known.wind_up[i]), _DIGITS)
    table["offset"] = offset
    table["extension_scale"] = round(float(known.scale[3]), _DIGITS)
    if len(shares):
        table["wind_up"] = shares
    uncertainty = tomlkit.table()
    uncertainty.comment("in m and rad")
    uncertainty["parameters"] = list(known.parameters)
    uncertainty["standard_deviation"] = [float(f"{x:.6g}") for x in np.sqrt(np.diag(known.covariance))]
    uncertainty["covariance"] = [[float(f"{x:.8g}") for x in row] for row in known.covariance]
    table["uncertainty"] = uncertainty
    return table
