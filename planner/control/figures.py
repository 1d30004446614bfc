"""Figures of the closed loop that neither the thesis nor a datasheet gives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from boom_model.arrays import scalar
from boom_model.errors import InputError

RATES = 50.0, 20_000.0
"""Range of the sampling rate [Hz].

Below it no controller stabilises the boom. Above it a move has too many samples.
"""


def _assumed(value: float, why: str, *, zero: bool = False) -> Any:
    return field(default=value, metadata={"why": why, "zero": zero})


@dataclass(frozen=True)
class Figures:
    """Assumed figures of controller, sensors, damping and link sections.

    The name contains the unit. Figures without one are pure numbers.
    """

    rate_Hz: float = _assumed(1000.0, "sampling rate of the controller")
    encoder_counts: float = _assumed(4000.0, "counts per turn of the motor encoder; 0 is exact", zero=True)
    joint_counts: float = _assumed(131072.0, "counts per turn at a joint without a drive, 17 bit; 0 is exact", zero=True)
    extension_count_mm: float = _assumed(0.01, "resolution of the extension's encoder; 0 is exact", zero=True)
    velocity_filter_Hz: float = _assumed(100.0, "low-pass filter of the differentiated position")
    microsteps: float = _assumed(10.0, "microsteps per full step of a stepper")
    rotor_damping: float = _assumed(0.1, "damping ratio of a stepper's rotor about its command")
    structural_damping: float = _assumed(0.02, "damping ratio of the lowest mode with the motors fixed", zero=True)
    friction_share: float = _assumed(
        1.0, "share of the gearbox datasheet's no-load torque and loss that is simulated", zero=True
    )
    stick_deg_s: float = _assumed(1.0, "joint speed at which Coulomb friction reaches 76 % of its full value")
    inner_height_mm: float = _assumed(139.0, "height of the inner link as a bar of its mass, 10 mm wide, steel of 7850 kg/m^3")
    inner_width_mm: float = _assumed(10.0, "width of the inner link, two plates of 5 mm")
    inner_modulus_GPa: float = _assumed(
        200.0, "modulus of the inner link, structural steel, as the thesis prints for its optimised link"
    )
    extension_side_mm: float = _assumed(40.0, "side of the extension, a square tube of aluminium")
    extension_wall_mm: float = _assumed(4.5, "wall with which this tube has the extension's mass over 1.2 m")
    extension_modulus_GPa: float = _assumed(69.0, "modulus of the extension, aluminium")
    extension_clear_mm: float = _assumed(50.0, "length of the retracted extension outside its housing", zero=True)
    given: tuple[str, ...] = ()
    """Names of the figures that the user gave. These are not assumed."""

    @staticmethod
    def of(values: Mapping[str, float] | None = None) -> "Figures":
        """Return the figures with the given values in place of the assumed ones.

        Raises:
            InputError: a name is unknown, a value is not finite, negative or 0 where 0 has no
                meaning, the sampling rate is out of RATES, or the wall is too thick for the tube.
        """
        known = {f.name: f for f in fields(Figures) if f.metadata}
        ready = {}
        for name, value in (values or {}).items():
            if name not in known:
                raise InputError(f"unknown figure {name!r}; the figures are: {', '.join(known)}")
            ready[name] = scalar(name, value)
            if ready[name] < 0.0 or (ready[name] == 0.0 and not known[name].metadata["zero"]):
                raise InputError(f"{name} is {value:g}; it must be {'at least' if known[name].metadata['zero'] else 'above'} 0")
        figures = Figures(**ready, given=tuple(ready))
        if not RATES[0] <= figures.rate_Hz <= RATES[1]:
            raise InputError(f"rate_Hz is {figures.rate_Hz:g}; it must be from {RATES[0]:g} to {RATES[1]:g}")
        if 2.0 * figures.extension_wall_mm > figures.extension_side_mm:
            raise InputError(
                f"extension_wall_mm is {figures.extension_wall_mm:g}; it must be at most half of extension_side_mm, "
                f"{figures.extension_side_mm:g}"
            )
        return figures

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Sentence for each figure that the user did not give."""
        return tuple(
            f"{f.name} {getattr(self, f.name):g}: {f.metadata['why']}"
            for f in fields(self)
            if f.metadata and f.name not in self.given
        )

    @property
    def sampling_period(self) -> float:
        """Sampling period T [s]."""
        return 1.0 / self.rate_Hz

    @property
    def inner_bending(self) -> float:
        """Bending stiffness E I = E w H^3 / 12 of the inner link in the arm's plane [Nm^2]."""
        return self.inner_modulus_GPa * 1e9 * self.inner_width_mm * self.inner_height_mm**3 * 1e-12 / 12.0

    @property
    def extension_bending(self) -> float:
        """Bending stiffness E I = E (a^4 - (a - 2 w)^4) / 12 of the extension [Nm^2]."""
        side, hollow = self.extension_side_mm, self.extension_side_mm - 2.0 * self.extension_wall_mm
        return self.extension_modulus_GPa * 1e9 * (side**4 - hollow**4) * 1e-12 / 12.0


def parse_figures(texts: Sequence[str]) -> Figures:
    """Return the figures that texts of the form NAME=VALUE give.

    Raises:
        InputError: a text does not have this form, or as `Figures.of`.
    """
    values = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"{text!r} is not NAME=VALUE with a number as the value") from None
    return Figures.of(values)
