"""Files of a designed link: contour, stations, outline, and the boom with the link."""

import csv
from pathlib import Path

import numpy as np

from boom_model import Body
from boom_model.boom_file import BOOM_FILE
from boom_model.link_design import internal_forces
from boom_model.toml_file import editable_toml
from planner.files import replacing
from planner.links.design import LinkDesign

COLUMNS = (
    "x_m",
    "height_m",
    "width_m",
    "area_m2",
    "second_moment_m4",
    "normal_N",
    "shear_N",
    "moment_Nm",
    "von_mises_Pa",
)
"""Header of the stations. Forces are those of the load case with the largest deflection; the stress
is the largest of all cases."""


def write_contour(path: str | Path, design: LinkDesign) -> None:
    """Write x, H/2 and 0 [m] of each station, separated by tabs, as points of a CAD curve.

    Mirror the curve for the other edge.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    lines = [f"{x:.6f}\t{h / 2.0:.9f}\t0" for x, h in zip(design.beam.stations, design.heights, strict=True)]
    with replacing(path) as temporary:
        Path(temporary).write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_stations(path: str | Path, design: LinkDesign) -> None:
    """Write the stations as CSV with the header COLUMNS, for a beam element program.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    H, w = design.heights, design.beam.width
    forces = [f[0] for f in internal_forces(design.beam, H, design.cases.at([design.worst]))]
    rows = np.stack([design.beam.stations, H, np.full_like(H, w), w * H, w * H**3 / 12.0, *forces, design.stress], axis=-1)
    with replacing(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([f"{value:.9g}" for value in row] for row in rows)


def write_outline(path: str | Path, design: LinkDesign) -> None:
    """Write the closed outline of one plate as DXF in millimetres.

    The outline is on layer PLATE, and the centres of the pins are on layer PINS. The contour runs
    from pin to pin; bosses, holes and transitions to the fittings are added in CAD.

    Raises:
        InputError: the file cannot be written; an old one is left as it was.
    """
    from ezdxf import units
    from ezdxf.filemanagement import new

    x, half = 1e3 * design.beam.stations, 500.0 * design.heights
    points = [*zip(x, half, strict=True), *zip(x[::-1], -half[::-1], strict=True)]
    drawing = new("R2010", units=units.MM)
    for name in ("PLATE", "PINS"):
        drawing.layers.add(name)
    space = drawing.modelspace()
    space.add_lwpolyline(points, close=True, dxfattribs={"layer": "PLATE"})
    for center in ((0.0, 0.0), (float(x[-1]), 0.0)):
        space.add_point(center, dxfattribs={"layer": "PINS"})
    with replacing(path) as temporary:
        drawing.saveas(temporary)


def write_boom(path: str | Path, source: str | Path | None, design: LinkDesign) -> None:
    """Write the TOML file of the boom with mass, centre of mass and inertia of the new link.

    Everything else, including comments, stays unchanged.

    Args:
        path: the file to write.
        source: the file of the boom; None is the shipped one.
        design: the design of the link.

    Raises:
        InputError: a file cannot be read or written; an old one is left as it was.
    """
    import tomlkit

    document = editable_toml(BOOM_FILE if source is None else Path(source))
    bodies = document["bodies"]
    table = bodies[design.link.name]
    for key, value in _rounded(design.body).items():
        table[key] = value
    table["mass_kg"].comment(_origin(design))
    with replacing(path) as temporary:
        Path(temporary).write_text(tomlkit.dumps(document), encoding="utf-8")


def _rounded(body: Body) -> dict[str, object]:
    """Return the body rounded to 1e-6 kg, 1e-6 m and 1e-9 kg m^2."""
    inertia = (body.inertia + body.inertia.T) / 2.0
    return {
        "mass_kg": round(body.mass, 6),
        "com_m": [round(float(x), 6) + 0.0 for x in body.com],
        "inertia_kg_m2": [[round(float(x), 9) + 0.0 for x in row] for row in inertia],
    }


def _origin(design: LinkDesign) -> str:
    task = design.task
    fittings = "its fittings estimated" if design.link.fittings is not None else "without fittings, which are unknown"
    return f"designed: {task.method} method, loads of {task.load}, {task.material}; {fittings}"
