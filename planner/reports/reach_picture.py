"""Picture of the reach in the vertical plane of the arm."""

from pathlib import Path

import numpy as np

from boom_model import JOINTS, Basis, Boom, frame_transforms
from boom_model.arrays import Array
from boom_model.drives.drive import drive_torque_limit
from boom_model.kinematics.reach import ReachMap
from planner.files import replacing

OVERLOADED = (213, 94, 0)
"""Colour of a negative margin: above the limit of a drive."""
OUTSIDE_LIMITS = (222, 222, 222)
MARGIN_UNKNOWN = (204, 121, 167)
"""Colour of cells reached by a boom without drives."""
_COLORMAP = "viridis"  # readable with colour blindness, and without the grey of OUTSIDE_LIMITS


def write_reach_picture(path: str | Path, boom: Boom, reach_map: ReachMap, title: str, *, show_boom: bool = True) -> None:
    """Write a PNG of a reach map: the torque margin as colour, with the boom at its reference pose.

    Args:
        path: the .png file.
        boom: the boom of the map.
        reach_map: the map.
        title: title of the picture; `reach_title` gives the assumptions of the map.
        show_boom: whether to draw the links at `reference_pose`, for scale.

    Raises:
        InputError: the file cannot be written. An existing file is left unchanged.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    tall = float(np.ptp(_edges(reach_map.z)) / np.ptp(_edges(reach_map.r)))
    figure = Figure(figsize=(11.0, float(np.clip(9.0 * tall, 2.0, 20.0)) + 2.0), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.pcolormesh(_edges(reach_map.r), _edges(reach_map.z), _cell_colors(reach_map), rasterized=True)
    legend: list[Patch | Line2D] = []
    for name, color, shown in (
        ("reached; margin unknown (no drives)", MARGIN_UNKNOWN, reach_map.within_limits & np.isnan(reach_map.torque_margin)),
        ("above a drive's limit", OVERLOADED, reach_map.torque_margin < 0.0),
        ("only outside the joint limits", OUTSIDE_LIMITS, reach_map.exists & ~reach_map.within_limits),
    ):
        if shown.any():
            legend.append(Patch(facecolor=_hex(color), edgecolor="black", label=name))
    if np.isfinite(reach_map.torque_margin).any():
        low, high = margin_range(reach_map)
        colors = ScalarMappable(Normalize(low, high), _COLORMAP)
        figure.colorbar(colors, cax=axes.inset_axes((1.02, 0.0, 0.025, 1.0)), label="torque margin [-]")
    if show_boom:
        q, name = reference_pose(boom)
        for line in _links(boom, q):
            axes.plot(line[:, 0], line[:, 1], color="white", linewidth=4.5, solid_capstyle="round")
            axes.plot(line[:, 0], line[:, 1], color="black", linewidth=2.0, marker="o", markersize=3.5)
        legend.append(Line2D([], [], color="black", marker="o", markersize=3.5, linewidth=2.0, label=f"boom, {name}"))
    if legend:
        axes.legend(handles=legend, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=len(legend), frameon=False)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("r, along x of frame 1 [m]")
    axes.set_ylabel("z in frame 1 [m]")
    axes.set_aspect("equal")
    axes.grid(color="black", alpha=0.15, linewidth=0.5)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png")


def reach_title(boom: Boom, reach_map: ReachMap) -> str:
    """Return a title in lines.

    They give constraint, pitch and payload; the joints that count; and the assumptions.
    """
    driven = [drive is not None and drive_torque_limit(drive, 0.0) is not None for drive in boom.drives]
    counted, left_out = (", ".join(j for j, d in zip(JOINTS, driven, strict=True) if d is which) for which in (True, False))
    without = f"; not counted, without drive data: {left_out}" if left_out else ""
    counts = f"torque margin of {counted}{without}" if counted else "no drives"
    lines = [
        f"{boom.name}: reach with constraint {reach_map.constraint}, pitch {np.degrees(reach_map.pitch):.4g} deg, "
        f"payload {boom.payload.mass:g} kg",
        f"At rest on level ground; {counts}",
        "Collisions with the ground, the vehicle or the boom itself are not checked",
    ]
    assumed: dict[str, list[str]] = {}
    for joint, drive in zip(JOINTS, boom.drives, strict=True):
        if drive is not None and drive.bus_voltage is not None and drive.bus_voltage.origin.basis is Basis.ASSUMED:
            assumed.setdefault(f"bus voltage {drive.bus_voltage.value:g} V", []).append(joint)
        if drive is not None and drive.wiring is not None and drive.wiring.origin.basis is Basis.ASSUMED:
            assumed.setdefault(f"wiring {drive.wiring.value}", []).append(joint)
    for joint, origin in zip(JOINTS, boom.limits.origins["position"], strict=True):
        if origin.basis is Basis.ASSUMED:
            assumed.setdefault("position limits", []).append(joint)
    if assumed:
        lines[-1] += "; assumed: " + "; ".join(f"{what} ({', '.join(joints)})" for what, joints in assumed.items())
    return "\n".join(lines)


def reference_pose(boom: Boom) -> tuple[Array, str]:
    """Return a joint position (5,) in the plane of the map, and its name, to draw the boom at."""
    phenotyping = boom.poses.get("phenotyping")
    q = (boom.limits.lower + boom.limits.upper) / 2.0 if phenotyping is None else phenotyping
    return np.array([0.0, *q[1:]]), "middle of its joint ranges" if phenotyping is None else "phenotyping pose"


def margin_range(reach_map: ReachMap) -> tuple[float, float]:
    """Return the range of the colours: the margins of the map to tenths, and none below 0."""
    tenths = 10.0 * reach_map.torque_margin
    low = max(float(np.floor(np.nanmin(tenths))) / 10.0, 0.0)
    return low, max(float(np.ceil(np.nanmax(tenths))) / 10.0, low + 0.1)


def margin_colors(margin: Array, between: tuple[float, float]) -> Array:
    """Return RGB (k, 3), 0 to 255, of margins (k,); OVERLOADED below 0, MARGIN_UNKNOWN for NaN."""
    import matplotlib

    low, high = between
    share = np.clip((np.nan_to_num(margin) - low) / (high - low), 0.0, 1.0)
    colors: Array = 255.0 * np.asarray(matplotlib.colormaps[_COLORMAP](share))[:, :3]
    colors[margin < 0.0], colors[np.isnan(margin)] = OVERLOADED, MARGIN_UNKNOWN
    return np.rint(colors)


def _hex(color: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)


def _cell_colors(reach_map: ReachMap) -> Array:
    """Return RGBA (m, n, 4), 0 to 1, transparent where nothing is reached."""
    within, margin = reach_map.within_limits, reach_map.torque_margin
    between = margin_range(reach_map) if np.isfinite(margin).any() else (0.0, 1.0)
    colors = np.zeros((*within.shape, 4))
    colors[reach_map.exists] = (*OUTSIDE_LIMITS, 255.0)
    colors[within, :3] = margin_colors(margin[within], between)
    colors[within, 3] = 255.0
    return colors / 255.0


def _edges(middles: Array) -> Array:
    """Return the bounds (n + 1,) of cells around their middles (n,); a single cell is 1 mm wide."""
    if middles.size == 1:
        return np.array([middles[0] - 5e-4, middles[0] + 5e-4])
    between = (middles[1:] + middles[:-1]) / 2.0
    return np.array([2.0 * middles[0] - between[0], *between, 2.0 * middles[-1] - between[-1]])


def _links(boom: Boom, q: Array) -> list[Array]:
    """Return the links as lines of (x, z) [m], for q with yaw 0.

    They are the base, the inner link, and the arm from the shoulder along the outer link.
    """
    outer = frame_transforms(boom, q, "outer")[:, :3, 3][:, [0, 2]]
    inner = frame_transforms(boom, q, "inner")[:, :3, 3][:, [0, 2]]
    shoulder, pins, wrist, tip = outer[4], outer[5:8], outer[8], outer[10]
    corner = wrist + (boom.geometry.L7 + q[3]) * np.array([np.cos(q[2]), np.sin(q[2])])  # on the actuator's axis, beside pin 8
    return [np.array([outer[0], outer[2], shoulder]), inner[4:6], np.array([shoulder, *pins, corner, wrist, tip])]
