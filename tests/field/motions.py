"""A vehicle that drives, rolls and pitches as closed formulas say, and what its instruments would
have logged."""

from dataclasses import dataclass

import numpy as np

from boom_model.arrays import Array
from planner.field import attitude
from planner.field.earth import LocalFrame, geodetic_of
from planner.field.vehicle_log import VehicleLog

SASKATOON = LocalFrame.at(np.radians(52.13), np.radians(-106.62), 480.0)


@dataclass(frozen=True)
class Drive:
    """A gentle curve at a given mean speed over rough ground."""

    speed: float = 1.4
    turning: float = 0.02
    """[rad/s]"""
    sway: float = 0.03
    """[rad] of roll and pitch"""
    begin: float = 0.7
    """[rad] heading at the start"""
    heave: float = 0.02
    """[m]"""
    frame: LocalFrame = SASKATOON
    surge: float = 0.0
    """[m] by which it gets ahead and falls behind, as the speed changes"""

    def _turned(self, t: Array) -> Array:
        """(n,) heading along the curve [rad]."""
        return self.begin + self.turning * (t + self.surge / self.speed * np.sin(0.5 * t))

    def origin(self, t: Array) -> Array:
        """(n, 3) east, north, up of the vehicle's origin [m]."""
        heading = self._turned(t)
        radius = self.speed / self.turning
        east = radius * (np.cos(self.begin) - np.cos(heading))
        north = radius * (np.sin(heading) - np.sin(self.begin))
        return np.stack([east, north, self.heave * np.sin(2.0 * t)], axis=-1)

    def angles(self, t: Array) -> Array:
        """(n, 3) roll, pitch, heading [rad]."""
        return np.stack(
            [
                self.sway * np.sin(1.9 * t),
                self.sway * np.cos(1.3 * t + 0.4),
                self._turned(t) + 0.3 * self.sway * np.sin(t),
            ],
            axis=-1,
        )

    def point(self, t: Array, r: Array) -> Array:
        """(n, 3) ECEF of a point at r (3,) or (n, 3) on the vehicle [m]."""
        R = attitude.rotation(*self.angles(t).T)
        return self.frame.ecef(self.origin(t) + np.einsum("nij,nj->ni", R, np.broadcast_to(r, (len(t), 3))))

    def log(
        self,
        t: Array,
        antenna: Array,
        position_std: float = 0.0,
        angle_std: float = 0.0,
        *,
        late: float = 0.0,
        velocity: bool = False,
        seed: int = 0,
    ) -> VehicleLog:
        """The log of an antenna at some time stamps, with white noise; `late` is how
        late they are."""
        random, true = np.random.default_rng(seed), t - late
        ecef = self.point(true, antenna) + random.normal(0.0, position_std, (len(t), 3)) @ self.frame.R_ecef_enu.T
        noisy = self.angles(true) + random.normal(0.0, angle_std, (len(t), 3))
        half = 1e-4
        rates = (self.point(true + half, antenna) - self.point(true - half, antenna)) / (2.0 * half)
        return VehicleLog.of(
            t,
            *geodetic_of(ecef),
            *noisy.T,
            velocity=rates @ self.frame.R_ecef_enu if velocity else None,
            position_covariance=position_std**2,
            attitude_covariance=angle_std**2,
        )
