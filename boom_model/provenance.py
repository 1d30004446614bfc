"""Where a figure comes from: printed in a source, estimated from printed figures, or assumed."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

T = TypeVar("T")


class Basis(StrEnum):
    """How far a figure can be trusted, strongest first."""

    PRINTED = "printed"
    ESTIMATED = "estimated"
    ASSUMED = "assumed"

    @staticmethod
    def weakest(bases: "Iterable[Basis]") -> "Basis":
        """A result is as good as the weakest figure that decides it."""
        order = list(Basis)
        return max(bases, key=order.index, default=Basis.PRINTED)


@dataclass(frozen=True)
class Origin:
    """Basis and source of a figure."""

    basis: Basis
    source: str


@dataclass(frozen=True)
class Sourced(Generic[T]):
    """A value that travels with its origin."""

    value: T
    origin: Origin
