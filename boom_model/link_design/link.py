"""Links of the boom as beams, and a designed beam as the body of a link."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from boom_model.arrays import Array, read_only
from boom_model.boom import Body, Boom
from boom_model.boom_file import Triple, inertia_tensor
from boom_model.errors import InputError
from boom_model.kinematics.frames import R_LINK_BODY
from boom_model.link_design.beam import Beam, Support
from boom_model.link_design.materials import Material
from boom_model.plausible import MASS, THICKNESS, WIDTH
from boom_model.provenance import Basis, Origin
from boom_model.toml_file import Table, parse_toml, validated
from boom_model.words import unknown

LINKS_FILE = Path(str(files("boom_model") / "data" / "links.toml"))

LINKS = ("inner", "lower", "outer", "extension")
"""Links that can be designed.

Each is clamped at its root, except the outer one, which is a strut between two pins.
"""

_TURNED = read_only(np.diag([-1.0, 1.0, -1.0]))
"""Rotation from the link axes (e, p, n) to those of the extension's beam, whose end is the wrist.

The e axis of the extension points away from the wrist.
"""


@dataclass(frozen=True, eq=False)
class Link:
    """Construction of a link, including the parts that the design does not change."""

    name: str
    length: float
    """Distance between its pins; for the extension, the free length at full stroke [m]"""
    support: Support
    width: float
    """Width of all plates together [m]"""
    plates: int
    spacing: float
    """Distance between the middles of the outermost plates [m]"""
    designed: tuple[float, float]
    """Part of the length whose contour is designed, as fractions.

    The rest belongs to the fittings.
    """
    origin: Origin
    """Origin of the plates and their spacing"""
    fittings: Body | None
    """Fittings along the axes of the beam, about its root; None if unknown"""
    fittings_origin: Origin | None
    cross_plates: int = 0
    """Number of plates between the plates, evenly spaced along the designed part.

    Each is as thick as one plate and as high as the contour at its position.
    """

    def __post_init__(self) -> None:
        (first, last), thickness = self.designed, self.width / self.plates
        together = (self.plates - 1) * thickness
        if not first < last:
            raise InputError(f"{self.name} link: designed_to is {last:g}; it must be above designed_from, {first:g}")
        if self.spacing < together * (1.0 - 1e-9):
            raise InputError(
                f"{self.name} link: spacing is {self.spacing:g} m; {self.plates} plates of {thickness:g} m need at least "
                f"{together:g} m between the middles of the outermost plates"
            )
        if self.cross_plates * thickness > (last - first) * self.length:
            raise InputError(
                f"{self.name} link: {self.cross_plates} cross plates of {thickness:g} m do not fit into the "
                f"{(last - first) * self.length:g} m of its designed part"
            )

    def beam(self, material: Material, slices: int) -> Beam:
        """Return the link as a beam."""
        return Beam(self.length, self.width, material, slices=slices, plates=self.plates, support=self.support)


def load_link(boom: Boom, name: str, path: str | Path | None = None) -> Link:
    """Load a link of a boom, with the plates and fittings of a TOML file.

    If path is None, load the shipped `boom_model/data/links.toml`.

    Raises:
        InputError: unknown link, a file that cannot be read or has the wrong form, or plates that
            do not fit. The message names the key.
    """
    file = LINKS_FILE if path is None else Path(path)
    return link_of(boom, name, parse_toml(file), str(file))


def link_of(boom: Boom, name: str, data: dict[str, Any], file: str) -> Link:
    """Return a link of a links' file that is read already; `file` is its name in messages.

    Raises:
        InputError: as `load_link`.
    """
    table = validated(file, data, _LinksTable).links
    if name not in LINKS or name not in table:
        raise unknown("link", name, (each for each in LINKS if each in table))
    g, t = boom.geometry, table[name]
    lengths = {"inner": g.L9, "lower": g.L3, "outer": g.L4, "extension": float(boom.limits.upper[3])}
    if not lengths[name] > 0.0:
        raise InputError(f"the {name} link's length is {lengths[name]:g} m; it must be above 0 m to be designed")
    fittings = t.fittings
    return Link(
        name=name,
        length=lengths[name],
        support="pinned" if name == "outer" else "cantilever",
        width=t.width_m,
        plates=t.plates,
        spacing=t.spacing_m,
        designed=(t.designed_from, t.designed_to),
        origin=Origin(Basis(t.basis), t.source),
        fittings=None if fittings is None else Body(fittings.mass_kg, read_only(fittings.com_m), fittings.inertia_kg_m2),
        fittings_origin=None if fittings is None else Origin(Basis(fittings.basis), fittings.source),
        cross_plates=t.cross_plates,
    )


def link_body(link: Link, beam: Beam, H: Array) -> Body:
    """Return the whole link as a body in its frame: plates, cross plates and fittings.

    Only the designed part of the plates counts. A plate's element is a bar as long as a slice, of
    height H, as thick as a plate, and half the spacing off the middle plane.
    """
    first, last = (round(share * beam.slices) for share in link.designed)
    dx, rho = beam.step, beam.material.density
    x = (np.arange(first, last) + 0.5) * dx
    h = (H[first:last] + H[first + 1 : last + 1]) / 2.0
    thickness = beam.width / beam.plates
    m = rho * beam.width * dx * h
    off = np.linspace(-0.5, 0.5, beam.plates) * link.spacing if beam.plates > 1 else np.zeros(1)
    zz = float((off**2).mean()) + thickness**2 / 12.0
    parts = [_moments(m, x, dx**2 / 12.0, h**2 / 12.0, zz)]
    if link.cross_plates:
        gap = link.spacing - thickness
        at = (
            np.array(link.designed[0]) + (np.arange(link.cross_plates) + 0.5) / link.cross_plates * np.ptp(link.designed)
        ) * beam.length
        high = np.interp(at, beam.stations, H)
        parts.append(_moments(rho * gap * thickness * high, at, thickness**2 / 12.0, high**2 / 12.0, gap**2 / 12.0))
    if link.fittings is not None:
        parts.append(_pseudo_inertia(link.fittings))
    P = np.sum(parts, axis=0)
    mass, com = P[0, 0], P[0, 1:] / P[0, 0]
    second = P[1:, 1:] - mass * np.outer(com, com)
    if link.name == "extension":  # its beam runs from its root to the wrist, where its frame is
        com = _TURNED @ (com - np.array([link.length, 0.0, 0.0]))
        second = _TURNED @ second @ _TURNED
    R = R_LINK_BODY[link.name].T
    inertia = R @ (np.trace(second) * np.eye(3) - second) @ R.T
    return Body(float(mass), read_only(R @ com), read_only((inertia + inertia.T) / 2.0))


def with_body(boom: Boom, name: str, body: Body) -> Boom:
    """Return the boom with another body."""
    bodies: Mapping[str, Body] = {**boom.bodies, name: body}
    return replace(boom, bodies=bodies)


def _moments(m: Any, x: Any, xx: Any, yy: Any, zz: Any) -> Array:
    """Return int (1, r)(1, r)^T dm (4, 4) of bars at (x, 0, 0) with second moments of their own."""
    P = np.zeros((4, 4))
    P[0, 0] = m.sum()
    P[0, 1] = P[1, 0] = m @ x
    P[1, 1] = m @ (x**2 + xx)
    P[2, 2] = m @ np.broadcast_to(yy, m.shape)
    P[3, 3] = m.sum() * zz
    return P


def _pseudo_inertia(body: Body) -> Array:
    P = np.empty((4, 4))
    P[0, 0] = body.mass
    P[0, 1:] = P[1:, 0] = body.mass * body.com
    P[1:, 1:] = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    return P


class _FittingsTable(Table):
    mass_kg: Annotated[float, MASS]
    com_m: Triple
    inertia_kg_m2: Annotated[Any, AfterValidator(inertia_tensor)]
    basis: Literal["printed", "estimated", "assumed"]
    source: str


class _LinkTable(Table):
    width_m: Annotated[float, THICKNESS]
    plates: Annotated[int, Field(ge=1, le=100)]
    spacing_m: Annotated[float, WIDTH]
    designed_from: Annotated[float, Field(ge=0, lt=1)] = 0.0
    designed_to: Annotated[float, Field(gt=0, le=1)] = 1.0
    cross_plates: Annotated[int, Field(ge=0, le=1000)] = 0
    basis: Literal["printed", "estimated", "assumed"]
    source: str
    fittings: _FittingsTable | None = None


class _LinksTable(Table):
    links: dict[str, _LinkTable] = Field(default_factory=dict)
