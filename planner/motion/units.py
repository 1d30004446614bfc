"""Units of a motion's file: degrees, millimetres, milliseconds are refused with the guess."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from boom_model.arrays import Array
from boom_model.boom import IS_LENGTH, JOINTS
from boom_model.errors import InputError

MOST_TURNS = 2
"""Turns from zero beyond which an angle is taken to be in degrees."""

MOST_EXTENSION = 20.0
"""Extension [m] beyond which it is taken to be in millimetres."""

_DEGREE = float(np.degrees(1.0))
_ALIKE, _NEAR = 0.99, 0.05
_CREEP = 1e-3  # [rad/s, m/s]
_FEW = 10


def require_si(path: str | Path, data: Mapping[str, Array]) -> None:
    """Refuse a motion whose numbers are not in rad, m and s.

    A position beyond MOST_TURNS or MOST_EXTENSION gives degrees or millimetres away. Where a
    quantity and its rate are both given, the factor k that best fits

        q(t) - q(0) = k integral of qd dt

    does: 1 in SI, 57.3 if only q is in degrees, 0.001 if t is in milliseconds. So it is with qd and
    qdd. Times alone are taken to be milliseconds if all are whole numbers and nothing moves faster
    than 1e-3 rad/s or m/s.

    Args:
        path: of the file, for the message.
        data: t (n,), q (n, 5), and qd and qdd (n, 5) where given.

    Raises:
        InputError: the numbers look like another unit; the message says which.
    """
    t, q = data["t"], data["q"]
    if not t.size:
        return
    largest = np.abs(q).max(axis=0)
    for i, joint in enumerate(JOINTS):
        if IS_LENGTH[i] and largest[i] > MOST_EXTENSION:
            _refuse(path, f"q{i + 1} ({joint}) looks like millimetres: it reaches {largest[i]:.6g}; it must be in m")
        if not IS_LENGTH[i] and largest[i] > MOST_TURNS * 2.0 * np.pi:
            _refuse(path, f"q looks like degrees: q{i + 1} ({joint}) reaches {largest[i]:.6g}; angles must be in rad")
    for name, rate, per, squared in (("q", "qd", "rad/s", "rad"), ("qd", "qdd", "rad/s^2", "rad/s")):
        if name in data and rate in data:
            _require_rate(path, t, (name, data[name], squared), (rate, data[rate], per))
    if "qd" not in data:
        _require_seconds(path, t, q)


def _require_rate(path: str | Path, t: Array, value: tuple[str, Array, str], rate: tuple[str, Array, str]) -> None:
    (name, q, unit), (rate_name, qd, rate_unit) = value, rate
    steps = np.diff(t)[:, None]
    summed = np.cumsum((qd[1:] + qd[:-1]) / 2.0 * steps, axis=0)
    moved = q[1:] - q[0]
    angle, length = _factor(moved[:, ~IS_LENGTH], summed[:, ~IS_LENGTH]), _factor(moved[:, IS_LENGTH], summed[:, IS_LENGTH])
    known = [factor for factor in (angle, length) if factor is not None]
    for factor, unit_of_time in ((1e-3, "milliseconds"), (1e-6, "microseconds")):
        if known and all(_is(each, factor) for each in known):
            _refuse(path, f"t looks like {unit_of_time}: {name} changes at {1 / factor:g} times {rate_name}; t must be in s")
    for factor, meant in ((_DEGREE, f"{name} looks like degrees; it must be in {unit}"),
                          (1.0 / _DEGREE, f"{rate_name} looks like degrees; it must be in {rate_unit}")):  # fmt: skip
        if angle is not None and _is(angle, factor):
            _refuse(path, f"{meant}: {name} changes at {angle:.4g} times {rate_name}")
    if length is not None and (_is(length, 1e3) or _is(length, 1e-3)):
        _refuse(path, f"{name}4 or {rate_name}4 looks like millimetres: {name}4 changes at {length:.4g} times {rate_name}4")


def _factor(moved: Array, summed: Array) -> float | None:
    """Return the ratio of a change to the integral of its rate; None unless they are similar."""
    both, own, other = (float((a * b).sum()) for a, b in ((moved, summed), (moved, moved), (summed, summed)))
    if own <= 0.0 or other <= 0.0 or both < _ALIKE * np.sqrt(own) * np.sqrt(other):
        return None
    return both / other


def _is(factor: float, one: float) -> bool:
    return abs(factor / one - 1.0) < _NEAR


def _require_seconds(path: str | Path, t: Array, q: Array) -> None:
    if t.size < _FEW or (t != np.rint(t)).any() or (np.diff(t) <= 0.0).any():
        return
    speed = float(np.abs(np.diff(q, axis=0) / np.diff(t)[:, None]).max())
    if 0.0 < speed < _CREEP:
        _refuse(path, f"t looks like milliseconds: no joint moves at more than {speed:.2g} per s; t must be in s")


def _refuse(path: str | Path, why: str) -> None:
    raise InputError(f"{path}: {why}")
