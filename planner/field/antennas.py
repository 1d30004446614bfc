"""A vehicle's log from several antennas: position of their middle, attitude from their baselines.

With positions p_i measured and places b_i on the body, both from their mean, the attitude R is the
one of least squares (Wahba's problem):

    min_R  sum_i |p_i - R b_i|^2

To first order, for errors of standard deviation s in each coordinate, its turning error has the
covariance s^2 (sum_i |b_i|^2 1 - b_i b_i^T)^-1 along the body's axes, and the middle s^2 / k. Two
antennas, or more on one line, say nothing of the turn about that line: the body is then taken as
level there.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from boom_model import InputError
from boom_model.arrays import Array, checked
from planner.field import attitude
from planner.field.assumed import NO_TILT_STD
from planner.field.earth import axes, geodetic_of
from planner.field.vehicle_log import VehicleLog

_LEAST_WIDTH = 0.01  # of the longest baseline: antennas nearer to a line than that are on it
_SHORTEST = 0.05  # [m]
_STEEPEST = 0.9  # sine of the elevation of a line of antennas that tells no heading


def log_of_antennas(
    t: ArrayLike,
    positions: Mapping[str, ArrayLike],
    places: Mapping[str, ArrayLike],
    std: float,
    *,
    clock: str = "own",
    source: str = "antennas",
) -> tuple[VehicleLog, Array]:
    """Return a log of the middle of antennas, and where that middle is on the body (3,) [m].

    A lever arm of the log is the place of a point less that middle.

    Args:
        t: (n,) times [s].
        positions: (n, 3) of each antenna in ECEF [m].
        places: (3,) of each antenna on the body, x forward, y left, z up [m].
        std: standard deviation of each coordinate of each position [m].
        clock: what the time is, as in `VehicleLog`.
        source: what messages call the log.

    Raises:
        InputError: fewer than two antennas, names that differ, or antennas that are too near to
            each other or above each other; or as `VehicleLog.of`.
    """
    if len(places) < 2 or set(places) != set(positions):
        raise InputError(f"{source}: {len(places)} places and {len(positions)} positions; two antennas or more need both")
    measured = np.stack([checked(f"positions of {name}", positions[name], 3) for name in places])
    on_body = np.stack([checked(f"place of {name}", places[name], 3) for name in places])
    middle, body = on_body.mean(axis=0), on_body - on_body.mean(axis=0)
    _, widths, lines = np.linalg.svd(body)
    if widths[0] < _SHORTEST:
        raise InputError(f"{source}: the antennas are {widths[0]:.3g} m apart; it must be {_SHORTEST:g} m at least")
    centre = measured.mean(axis=0)
    latitude, longitude, height = geodetic_of(centre)
    to_enu = np.swapaxes(axes(latitude, longitude), -1, -2)
    enu = np.einsum("nij,knj->nki", to_enu, measured - centre)
    in_line = widths[1] < _LEAST_WIDTH * widths[0]
    R = np.stack([_level(body, each, lines[0], source) if in_line else attitude.of_directions(body, each) for each in enu])
    squares = (body**2).sum() * np.eye(3) - body.T @ body
    spread = std**2 * np.linalg.pinv(squares, rcond=_LEAST_WIDTH**2, hermitian=True)
    if in_line:
        spread = spread + NO_TILT_STD**2 * np.outer(lines[0], lines[0])
    E = np.linalg.inv(attitude.error_axes(R)) @ R
    log = VehicleLog.of(
        t,
        latitude,
        longitude,
        height,
        *attitude.angles(R).T,
        position_covariance=std**2 / len(body),
        attitude_covariance=E @ spread @ np.swapaxes(E, -1, -2),
        clock=clock,
        source=source,
        notes=(_note(source, float(np.degrees(NO_TILT_STD))),) if in_line else (),
    )
    return log, middle


def _note(source: str, std: float) -> str:
    return f"{source}: the antennas are on a line; assumed level about it, with a standard deviation of {std:g} deg"


def _level(body: Array, enu: Array, line: Array, source: str) -> Array:
    """Return the attitude of antennas on a line: the line as measured, up nearest to vertical."""
    measured = enu.T @ (body @ line)
    measured /= np.linalg.norm(measured)
    if abs(line[2]) > _STEEPEST or abs(measured[2]) > _STEEPEST:
        raise InputError(f"{source}: the antennas are above each other, which tells no heading")
    up = np.array([0.0, 0.0, 1.0])

    def frame(x: Array) -> Array:
        y = np.cross(up, x)
        y /= np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)])

    R: Array = frame(measured) @ frame(line).T
    return R
