"""Geotags in words and tables: for the terminal, and as a report in Markdown."""

import numpy as np

from planner.field.on_plots import SURE, counts
from planner.field.plots import Located, PlotMap
from planner.field.rig import Rig
from planner.field.sensor_tags import SensorTags
from planner.reports.markdown import section, table

ACCURACY = ("", "std east", "north", "up", "95 % ellipse", "worst")
"""Columns of `accuracy_rows`: medians over the tags, and the largest long half axis."""
_PLOTS = ("plot", "row", "range", "spots", f"probability {SURE:g} or more", "least probability")
_RIG = ("part", "basis", "source")


def sentences(tags: SensorTags, plots: PlotMap | None = None, located: Located | None = None) -> list[str]:
    """Return how many triggers were tagged, what the sag is, and on how many plots they lie."""
    known = tags.known
    said = [
        f"{tags.triggers.source}: {len(known)} triggers, {known.sum()} tagged",
        f"sag by the gearboxes: {np.nanmedian(-tags.sag[:, 2]) * 1e3:.1f} mm (median), counted in",
    ]
    if plots is not None and located is not None:
        on, sure = int(located.on.sum()), int((located.probability >= SURE).sum())
        seen = len(counts(plots, located))
        said.append(f"{on} spots on {seen} of {len(plots.names)} plots, {sure} with a probability of {SURE:g} or more")
        if on < known.sum():
            said.append(f"{int(known.sum()) - on} spots on no plot, or likelier on none than on one")
    return said


def accuracy_rows(tags: SensorTags) -> list[tuple[str, ...]]:
    """Return deviations and 95 % ellipses of the sensor and of what it saw, under ACCURACY."""
    rows = []
    for name, each in (("sensor", tags.sensor), ("what it saw", tags.seen)):
        at = np.isfinite(each.ecef).all(axis=-1)
        if not at.any():
            continue
        std = np.sqrt(np.diagonal(each.covariance[at], axis1=1, axis2=2))
        long = each.ellipses[at, 0]
        figures = (*np.median(std, axis=0), np.median(long), np.max(long))
        rows.append((name, *(f"{figure * 1e3:.0f} mm" for figure in figures)))
    return rows


def all_notes(tags: SensorTags, plots: PlotMap | None) -> list[str]:
    """Return notes and assumptions of the tags and the map."""
    return [*tags.notes, *(() if plots is None else plots.notes)]


def tag_markdown(tags: SensorTags, rig: Rig, plots: PlotMap | None = None, located: Located | None = None) -> str:
    """Return the report of geotags as Markdown.

    Args:
        tags: the geotags.
        rig: the rig of the tags.
        plots: the map of plots, and with it
        located: the plot of each spot.
    """
    first, *more = sentences(tags, plots, located)
    lines = [f"# Geotags of {tags.triggers.source}", "", f"{first}.", "", *(f"- {each}" for each in more)]
    lines += ["", "## How sure the positions are", "", *table(ACCURACY, accuracy_rows(tags)), ""]
    lines.append("Medians over all tags; the ellipse is its long half axis, worst the largest of them.")
    if plots is not None and located is not None:
        lines += ["", f"## Plots of {plots.source}", "", *table(_PLOTS, _plot_rows(plots, located)), ""]
        lines.append(f"{len(plots.names) - len(counts(plots, located))} plots were not seen.")
    lines += section("Warnings", tags.warnings)
    lines += section("Triggers without a tag", tags.lost)
    rows = [(part, str(origin.basis), origin.source) for part, origin in rig.origins.items()]
    lines += ["", f"## Rig {rig.name}", "", *table(_RIG, rows)]
    notes = all_notes(tags, plots)
    lines += section("Assumptions", [note for note in notes if "assumed" in note])
    lines += section("Notes", [note for note in notes if "assumed" not in note])
    return "\n".join(lines) + "\n"


def _plot_rows(plots: PlotMap, located: Located) -> list[tuple[str, ...]]:
    def number(value: int | None) -> str:
        return "-" if value is None else str(value)

    place = {name: k for k, name in enumerate(plots.names)}
    return [
        (
            each.name,
            number(plots.rows[place[each.name]]),
            number(plots.ranges[place[each.name]]),
            str(each.spots),
            str(each.sure),
            f"{each.least:.3f}",
        )
        for each in counts(plots, located)
    ]
