"""What a link is designed for; the options of `boom link` are its fields."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from boom_model import InputError
from boom_model.arrays import scalar
from boom_model.dynamics.newton_euler import PayloadAs
from boom_model.plausible import DEFLECTION, HEIGHT, HEIGHT_STEP, SAFETY_FACTOR, TAPER, THICKNESS
from planner.option_field import OptionField, option_field, options_of

if TYPE_CHECKING:
    from boom_model.link_design import Limits, Link, Material


class LoadFrom(StrEnum):
    """Source of the loads of a link."""

    THESIS = "thesis"
    MOVES = "moves"


class Method(StrEnum):
    """Method that finds the heights of the plates."""

    THESIS = "thesis"
    EXACT = "exact"


@dataclass(frozen=True)
class LinkTask:
    """Requirements on a link."""

    link: str = option_field("inner", "Link to design.", "inner|lower|outer|extension")
    links: str | None = option_field(None, "File of plates and fittings; default: the shipped one.", "FILE.toml")
    load: str = option_field(
        LoadFrom.MOVES,
        "moves: every sample of the moves. thesis: the load case of the thesis.",
        choices=("moves", "thesis"),
    )
    method: str = option_field(
        Method.EXACT,
        "exact: least mass by optimality conditions. thesis: two-stage search of the thesis.",
        choices=("exact", "thesis"),
    )
    largest_components: bool = option_field(
        False, "Combine the largest value of each load component in one case, as in the thesis."
    )
    material: str = option_field("steel", "Material; the data of cfrp are assumed.", "steel|aluminium|cfrp")
    thickness: float | None = option_field(None, "Thickness of one plate; default: that of the link.", "M", quantity=THICKNESS)
    safety_factor: float = option_field(2.0, "Safety factor against yield and buckling.", "FACTOR", quantity=SAFETY_FACTOR)
    deflection: float = option_field(0.01, "Largest deflection.", "M", quantity=DEFLECTION)
    min_height: float = option_field(0.0, "Smallest height of the plates.", "M", quantity=HEIGHT)
    max_height: float | None = option_field(None, "Largest height of the plates; default: no limit.", "M", quantity=HEIGHT)
    max_taper: float | None = option_field(
        None, "Largest change of height per length; default: no limit.", "RATIO", quantity=TAPER
    )
    own_mass: bool = option_field(
        True,
        "Exact method: keep the moments of the first stage, as in the thesis, and leave out shear.",
        flag="--frozen",
    )
    """See `least_mass`."""
    shear: bool | None = option_field(
        None,
        "Exact method: include shear in the deflection. Default: yes for --load moves, no for thesis.",
        flag="--shear/--no-shear",
    )
    buckling: bool = option_field(True, "Exact method: leave out the buckling constraint.", flag="--no-buckling")
    slices: int = option_field(1000, "Number of slices along the link.", "N")
    step: float = option_field(1e-4, "Thesis method: height step delta-H.", "M", quantity=HEIGHT_STEP)
    payload_as: PayloadAs = "mass"
    """As in `inverse_dynamics`."""

    def __post_init__(self) -> None:
        by_thesis = self.method == Method.THESIS
        pointless = {
            "frozen moments leave out shear: choose one of them": not self.own_mass and self.shear is True,
            "the thesis's method always freezes the moments": by_thesis and not self.own_mass,
            "the thesis's method leaves out shear; use the exact method": by_thesis and self.shear is not None,
            "the thesis's method has no buckling constraint to leave out": by_thesis and not self.buckling,
            "the thesis's method always takes the largest components": by_thesis and self.largest_components,
            "the thesis's load is a single case: it has no largest components": self.load == LoadFrom.THESIS
            and self.largest_components,
        }
        for reason, asked in pointless.items():
            if asked:
                raise InputError(reason)
        for name, option in OPTIONS.items():
            value, words = getattr(self, name), name.replace("_", " ")
            if option.quantity is not None and value is not None:
                option.quantity.require(words, scalar(words, value))

    def sized(self, link: "Link") -> "Link":
        """Return the link with plates of the task's thickness; unchanged if it gives none."""
        return link if self.thickness is None else replace(link, width=self.thickness * link.plates)

    def limits(self, material: "Material") -> "Limits":
        """Return what a design must respect in a material."""
        from boom_model.link_design import Limits

        return Limits(
            stress=material.yield_stress / self.safety_factor,
            deflection=self.deflection,
            min_height=self.min_height,
            max_height=self.max_height,
            max_taper=self.max_taper,
            buckling_factor=self.safety_factor if self.buckling else None,
        )


OPTIONS: dict[str, OptionField] = options_of(LinkTask)
"""The fields that are options of `boom link`."""
