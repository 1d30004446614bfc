"""What a designed link must keep."""

from dataclasses import dataclass

from boom_model.arrays import scalar
from boom_model.errors import InputError


@dataclass(frozen=True)
class Limits:
    """What a link must keep."""

    stress: float
    """Largest von Mises stress [Pa]"""
    deflection: float
    """Largest deflection of a cantilever's end or a strut's middle [m]"""
    min_height: float = 0.0
    """[m]"""
    max_height: float | None = None
    """[m]; None leaves it free"""
    max_taper: float | None = None
    """Largest |dH/dx|; None leaves it free"""
    buckling_factor: float | None = None
    """Critical end load over the largest one; None does not ask for it"""

    def __post_init__(self) -> None:
        named = {"stress limit": self.stress, "deflection limit": self.deflection, "maximum height": self.max_height,
                 "maximum taper": self.max_taper, "buckling factor": self.buckling_factor}  # fmt: skip
        for name, value in named.items():
            if value is not None and not scalar(name, value) > 0.0:
                raise InputError(f"{name} is {value:g}; it must be above 0: nothing else holds it")
        if scalar("minimum height", self.min_height) < 0.0:
            raise InputError(f"minimum height is {self.min_height:g} m; it must be at least 0 m")
        if self.max_height is not None and self.min_height >= self.max_height:
            raise InputError(
                f"minimum height {self.min_height:g} m is not below the maximum of {self.max_height:g} m: no height is left"
            )
