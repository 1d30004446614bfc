"""Parsing of numbers, joint positions and names."""

from collections.abc import Iterable

import numpy as np

from boom_model.arrays import Array
from boom_model.errors import InputError
from boom_model.plausible import NUMBER

_LIKE = 0.65  # of 1; at 0.6 "elbow" would be like "lower"
_NOTHING = 1e-12  # degrees or metres; so small a distance would need an infinite speed along the path


def joint_position(text: str, rest: str) -> Array:
    """Return a joint position (5,) in SI from five comma-separated numbers [deg, m].

    Args:
        text: text that a message quotes.
        rest: the numbers.

    Raises:
        InputError: the numbers are malformed, not finite, or too many or too few.
    """
    q = np.array(numbers(text, rest, 5))
    q[[0, 1, 2, 4]] = np.radians(q[[0, 1, 2, 4]])
    return q


def numbers(text: str, rest: str, count: int) -> list[float]:
    """Return the `count` finite comma-separated numbers of `rest`.

    Raises:
        InputError: they are malformed, not finite, too many or too few; the message quotes `text`.
    """
    parts = rest.split(",")
    if len(parts) != count:
        given = "1 number" if len(parts) == 1 else f"{len(parts)} numbers"
        raise InputError(f"{text!r} has {given}; it needs {count}, separated by commas")
    return [number(text, part, "a number") for part in parts]


def number(name: str, text: str, what: str) -> float:
    """Return a finite number.

    Raises:
        InputError: `text` is not `what`, or not finite.
    """
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{name}: {text!r} is not {what}") from None
    if not np.isfinite(value):
        raise InputError(f"{name}: {text!r} must be finite")
    NUMBER.require(name, value)
    return value if abs(value) > _NOTHING else 0.0


def unknown(kind: str, name: object, known: Iterable[str], other: str = "") -> InputError:
    """Return the error for a name that is none of the known ones.

    It suggests the nearest, whatever its case.

    Args:
        kind: what is named, such as "pose".
        name: the name given.
        known: the names there are.
        other: what may be given instead of a name, such as "a FILE.toml".
    """
    names, given = list(known), str(name)
    meant = nearest_name(given, names)
    listed = f"{', '.join(names)}{f', or {other}' if other else ''}"
    if meant is None:
        return InputError(f"unknown {kind} {given!r}; there are: {listed}")
    return InputError(f"unknown {kind} {given!r}; did you mean {meant}? There are: {listed}")


def nearest_name(given: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like the one given, whatever its case, or None."""
    from difflib import get_close_matches

    names = {name.lower(): name for name in known}
    near = get_close_matches(given.lower(), names, n=1, cutoff=_LIKE)
    return names[near[0]] if near else None
