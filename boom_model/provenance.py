"""Provenance of a value: measured, printed, estimated from printed values, or assumed."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, Literal, TypeVar

T = TypeVar("T")
BasisName = Literal["measured", "printed", "estimated", "assumed"]
"""A basis as files name it."""


class Basis(StrEnum):
    """Reliability of a value, the most reliable first."""

    MEASURED = "measured"
    """On the machine itself, by `boom calibrate` or `boom identify`; the source names the log."""
    PRINTED = "printed"
    ESTIMATED = "estimated"
    ASSUMED = "assumed"

    @staticmethod
    def weakest(bases: "Iterable[Basis]") -> "Basis":
        """Return the weakest basis.

        A result is only as reliable as the weakest value that decides it.
        """
        return max(bases, key=_ORDER.__getitem__, default=Basis.PRINTED)


_ORDER = {basis: rank for rank, basis in enumerate(Basis)}


@dataclass(frozen=True)
class Origin:
    """Basis and source of a value."""

    basis: Basis
    source: str


@dataclass(frozen=True)
class Sourced(Generic[T]):
    """A value with its origin."""

    value: T
    origin: Origin
