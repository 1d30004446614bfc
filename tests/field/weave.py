"""A vehicle that weaves along a row of a trial, and its log."""

import numpy as np

from planner.field import attitude
from planner.field.earth import geodetic_of
from planner.field.scan_rows import rows_of
from planner.field.vehicle_log import VehicleLog
from tests.field.trials import trial

SPEED, BACK, BEYOND, OFFSET = 0.5, 1.0, 1.5, 1.9


class Weave:
    """A vehicle that passes the first row three times, weaving by 5 cm, and drives back.

    With a sway of 0 it goes straight and level.
    """

    def __init__(self, passes=3, sway=1.0):
        self.sway = sway
        self.plots = trial()[0]
        self.row = rows_of(self.plots)[0]
        low, high = self.row.span
        self.length = high - low + 2.0 * BEYOND
        self.each = self.length / SPEED + self.length / BACK
        self.t = np.arange(0.0, passes * self.each, 0.05)

    def along(self, t):
        since = t % self.each
        forward = self.length / SPEED
        return self.row.span[0] - BEYOND + np.where(since < forward, SPEED * since, self.length - BACK * (since - forward))

    def pose(self, t):
        """Places (n, 3) of the mount and R_enu_mount (n, 3, 3)."""
        w = 2.0 * np.pi / 8.0
        across = -OFFSET + 0.05 * self.sway * np.sin(w * t)
        flat = self.row.middle + self.along(t)[:, None] * self.row.ahead + across[:, None] * self.row.left
        east = np.arctan2(self.row.ahead[1], self.row.ahead[0]) + 0.08 * self.sway * np.cos(w * t)
        heading = np.pi / 2.0 - east
        R = attitude.rotation(0.02 * self.sway * np.sin(1.1 * t), 0.015 * self.sway * np.cos(0.9 * t), heading)
        return np.column_stack([flat, 0.02 * self.sway * np.sin(0.7 * t)]), R

    def log(self, noise=0.0, lever=(0.0, 0.0, 0.0), R_mount_imu=None):
        place, R = self.pose(self.t)
        place = place + np.einsum("nij,j->ni", R, np.asarray(lever))
        random = np.random.default_rng(2)
        ecef = self.plots.frame.ecef(place + random.normal(0.0, noise, place.shape))
        angles = attitude.angles(R if R_mount_imu is None else R @ R_mount_imu)
        return VehicleLog.of(self.t, *geodetic_of(ecef), *angles.T, position_covariance=noise**2, source="log.csv")


def write_weaving_log(place):
    """Write the log of the mount as CSV."""
    log = Weave().log(0.01)
    angles = np.degrees(np.column_stack([*log.geodetic[:2], log.angles]))
    rows = ["t,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,heading_deg,std_east_m,std_north_m,std_up_m"]
    for t, height, (north, east, *rest) in zip(log.t, log.geodetic[2], angles, strict=True):
        rows.append(f"{t:.3f},{north:.10f},{east:.10f},{height:.4f},{','.join(f'{a:.5f}' for a in rest)},0.01,0.01,0.01")
    place.write_text("\n".join(rows) + "\n")
