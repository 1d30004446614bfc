"""Slips in measured tips: sign of a joint, swapped joints, shifted rows, mirrored frame, unit."""

from collections.abc import Iterator

import numpy as np

from boom_model import JOINTS, InfeasibleError, InputError
from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, in_degrees
from planner.experiments.calibration_model import TipModel, aligned
from planner.experiments.measurements import Measurements

_FAR = 0.3  # [m] median distance beyond which something else than lengths and zeros is wrong
_EXPLAINED = 0.25  # of that distance, below which a slip explains it
_FEWEST = 4  # poses with all coordinates, to judge by
_STILL = 1e-3  # [rad, m]
_UNITS = {"centimetres": 100.0, "inches": 39.3701, "feet": 3.28084, "kilometres": 1e-3}


def require_plausible_tips(measured: Measurements, model: TipModel, known_frame: bool) -> None:
    """Refuse tips that no calibration of lengths and zeros brings to the boom of the file.

    The boom is put in its best place among the tips. If the median distance is then beyond 0.3 m,
    likely slips are tried.

    Raises:
        InputError: the tips are that far off; the message says which slip explains it, if one does.
    """
    whole = np.isfinite(measured.tip).all(axis=-1) & ~measured.by_distance
    if whole.sum() < _FEWEST:
        return
    q, tip = measured.readings[whole], measured.tip[whole]
    off = _median(model, q, tip, known_frame)
    if off <= _FAR:
        return
    found = [(_tried(model, readings, tips, known_frame), words) for words, readings, tips in _slips(q, tip)]
    least, words = min(found, key=lambda each: each[0])
    why = words if least < _EXPLAINED * off else "check the units, the signs of the joints, the order of the rows and --frame"
    left = f" ({least * 1e3:.0f} mm then)" if least < _EXPLAINED * off else ""
    raise InputError(f"{measured.name}: the tips are {off * 1e3:.0f} mm from those of the boom's file (median): {why}{left}")


def still_notes(measured: Measurements) -> tuple[str, ...]:
    """Name the joints that never move, with what to measure instead."""
    found = []
    for i, span in enumerate(np.ptp(measured.readings, axis=0)):
        if span < _STILL:
            at = f"{float(in_degrees(measured.readings[0])[i]):.4g} {'m' if IS_LENGTH[i] else 'deg'}"
            found.append(f"{JOINTS[i]} never moves (all at {at}): measure poses that differ in it, too (--suggest)")
    return tuple(found)


def _slips(q: Array, tip: Array) -> Iterator[tuple[str, Array, Array]]:
    """Yield what a slip looks like, with the readings and tips as they would be without it."""
    for i, joint in enumerate(JOINTS):
        this = np.arange(5) == i
        # the arm is flat: a mirrored frame cannot be told from a yaw that turns the other way
        mirrored = ", or make the measuring frame right-handed" if joint == "yaw" else ""
        yield f"q{i + 1} ({joint}) looks turned round: multiply it by -1{mirrored}", np.where(this, -q, q), tip
        if not IS_LENGTH[i]:
            yield f"q{i + 1} ({joint}) looks like degrees; it must be in rad", np.where(this, np.radians(q), q), tip
    yield "q2 (inner) and q3 (lower) look swapped", q[:, [0, 2, 1, 3, 4]], tip
    for shift, way in ((1, "earlier"), (-1, "later")):
        yield f"each tip looks like that of the row one {way}", q, np.roll(tip, -shift, axis=0)
    for unit, factor in _UNITS.items():
        yield f"x, y, z look like {unit}; they must be in m", q, tip / factor


def _tried(model: TipModel, q: Array, tip: Array, known_frame: bool) -> float:
    try:
        return _median(model, q, tip, known_frame)
    except (InfeasibleError, InputError):  # no such pose of the boom
        return float("inf")


def _median(model: TipModel, q: Array, tip: Array, known_frame: bool) -> float:
    at = model.tip(q, np.zeros_like(q))
    if not known_frame:
        frame = aligned(at, tip)
        at = at @ frame.R.T + frame.t
    return float(np.median(np.linalg.norm(tip - at, axis=-1)))
