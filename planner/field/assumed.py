"""What is assumed where a log does not say it: standard deviations, a heading from the track."""

import numpy as np
from numpy.typing import NDArray

from boom_model import InputError
from boom_model.arrays import Array
from planner.field.earth import axes, geodetic_of

STD_OF_QUALITY = {1: 3.0, 2: 1.0, 4: 0.02, 5: 0.4}
"""[m] horizontal, where a log gives only NMEA's quality: single, differential, fixed, float."""
_UP = 1.5  # of the horizontal
TILT_STD, HEADING_STD = float(np.radians(0.5)), float(np.radians(1.0))
"""[rad] of angles that were measured."""
NO_TILT_STD, TRACK_STD = float(np.radians(3.0)), float(np.radians(5.0))
"""[rad] of roll and pitch taken as level, and of a heading taken from the track."""
_BASELINE = 0.5  # [m] over which a heading is taken from the track


def covariance_of_quality(quality: NDArray[np.int_], source: str, *, known: bool = True) -> tuple[Array, tuple[str, ...]]:
    """Return covariances (n, 3, 3) [m^2] assumed from NMEA's quality, and a note that they are."""
    std = np.array([STD_OF_QUALITY.get(int(each), STD_OF_QUALITY[1]) for each in quality])
    spread = std[:, None] * [1.0, 1.0, _UP]
    figures = ", ".join(f"{each:g} m" for each in sorted(set(std)))
    of = "from the quality of the fix" if known else "as of a single fix, no std_east_m, std_north_m, std_up_m, no quality"
    return spread[:, :, None] ** 2 * np.eye(3), (f"{source}: assumed standard deviation of the position {figures}, {of}",)


def track_note(source: str) -> str:
    """Return what has to be known of a heading from the track."""
    return (
        f"{source}: no heading; taken from the track, so side slip turns it, with an assumed standard deviation of "
        f"{np.degrees(TRACK_STD):g} deg"
    )


def heading_of_track(ecef: Array, source: str) -> Array:
    """Return headings (n,) [rad] of a track (n, 3): from the fix 0.5 m back to that 0.5 m ahead.

    Raises:
        InputError: the track is shorter than that.
    """
    latitude, longitude, _ = geodetic_of(ecef)
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ecef, axis=0), axis=-1))])
    if np.linalg.norm(ecef - ecef[0], axis=-1).max() < 2.0 * _BASELINE:
        raise InputError(f"{source}: no heading, and the track stays within {2 * _BASELINE:g} m, so it gives none")
    back = np.maximum(np.searchsorted(travelled, travelled - _BASELINE, side="right") - 1, 0)
    ahead = np.minimum(np.searchsorted(travelled, travelled + _BASELINE), len(ecef) - 1)
    east, north, _ = np.moveaxis(np.einsum("nji,nj->ni", axes(latitude, longitude), ecef[ahead] - ecef[back]), -1, 0)
    headings: Array = np.arctan2(east, north)
    return headings
