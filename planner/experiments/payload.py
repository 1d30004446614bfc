"""Mass and centre of mass of the payload from one short move, with a boom otherwise known.

    tau - tau(boom without payload) = Y_m m + Y_h (m c) + Y_I (I_c + m (c.c 1 - c c^T))

is linear in m and m c but for the payload's inertia about the tip, which follows from them: it is
put in by iteration, with the inertia about the centre of mass in proportion to the mass. What a
move cannot tell of c (along the wrist's axis without yaw, say) is held at the file's figure, with a
standard deviation of 0.1 m. Weights and intervals are those of `identification`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from boom_model import Boom
from boom_model.arrays import Array, Mask, read_only
from boom_model.boom import Body
from boom_model.dynamics.regressor import body_parameters
from planner.experiments.identification import autocorrelation_time
from planner.experiments.log_checks import require_plausible_positions, require_plausible_torques
from planner.experiments.readings import Readings
from planner.experiments.unknowns import Unknowns

SURE = 1.96
"""Half width of an interval of 95 %, in standard deviations."""

_COM_SPREAD = 0.1  # [m]
_LEAST = 0.05  # [kg] mass below which a centre of mass means nothing
_ITERATIONS = 12


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """An identified payload."""

    boom: Boom
    """The boom with that payload."""
    deviation: float
    """Standard deviation of the mass [kg]."""
    com_deviation: Array
    """(3,) of the centre of mass in frame 11 [m]."""
    residual: Array
    """(5,) RMS of the torques that are not explained [Nm, N]."""
    noise: Array
    """(5,) standard deviation of the torques from sample to sample [Nm, N]."""
    notes: tuple[str, ...]

    @property
    def held(self) -> tuple[str, ...]:
        """Coordinates of the centre of mass that the move did not tell."""
        held: tuple[str, ...] = tuple(
            axis for axis, sigma in zip("xyz", self.com_deviation, strict=True) if sigma > _COM_SPREAD / 2
        )
        return held

    def to_json(self, files: dict[str, str]) -> dict[str, Any]:
        """Return the JSON object of `boom identify --payload-only`, in SI."""
        payload = self.boom.payload
        return {
            "mass_kg": payload.mass,
            "mass_deviation_kg": self.deviation,
            "interval_kg": [payload.mass - SURE * self.deviation, payload.mass + SURE * self.deviation],
            "com_m": payload.com.tolist(),
            "com_deviation_m": self.com_deviation.tolist(),
            "held": list(self.held),
            "residual": self.residual.tolist(),
            "noise": self.noise.tolist(),
            "notes": list(self.notes),
            "files": files,
        }


def identify_payload(boom: Boom, logs: Sequence[Readings], *, drive_inertia: bool = False) -> PayloadFit:
    """Identify the payload's mass and centre of mass; every other figure is the boom's.

    Args:
        boom: the boom, best as `identify` measured it; its payload is the starting point.
        logs: moves with the unknown payload, as the joints read; the boom's calibration is applied.
        drive_inertia: as in `identify`.

    Raises:
        InputError: the torques have the wrong sign, unit or side of the gearbox.
    """
    logs = [log.calibrated(boom) for log in logs]
    require_plausible_positions(boom, logs)
    require_plausible_torques(boom, logs, payload_known=False)
    unknowns = Unknowns(boom, drive_inertia, np.ones(5))
    parts = [_rows(unknowns, log) for log in logs]
    rows, right, used = (np.concatenate([part[k] for part in parts]) for k in range(3))
    variance = np.ones(5)
    x, covariance = np.zeros(4), np.eye(4)
    payload = boom.payload
    about_com = payload.inertia / payload.mass if payload.mass > 0.0 else np.zeros((3, 3))
    for _ in range(_ITERATIONS):
        mass = max(float(x[0]), 0.0)
        com = np.where(mass > _LEAST, x[1:] / max(mass, _LEAST), payload.com)
        inertia = body_parameters(Body(mass, read_only(com), read_only(about_com * mass)))[4:]
        weights = used / variance
        b = right - rows[..., 4:] @ inertia
        N = np.einsum("nj,njk,njl->kl", weights, rows[..., :4], rows[..., :4])
        g = np.einsum("nj,njk,nj->k", weights, rows[..., :4], b)
        # m c is near m c0: one row a coordinate, (m c - m c0) / (m spread)
        prior = np.hstack([-payload.com[:, None], np.eye(3)]) / (max(mass, _LEAST) * _COM_SPREAD)
        covariance = np.linalg.inv(N + prior.T @ prior)
        x = covariance @ g
        left = (b - rows[..., :4] @ x) * used
        variance = np.array([_variance(left[used[:, j], j]) for j in range(5)])
    mass = max(float(x[0]), 0.0)
    tellable = mass > _LEAST
    com = x[1:] / mass if tellable else payload.com
    slope = np.hstack([-com[:, None], np.eye(3)]) / max(mass, _LEAST)
    spread = np.sqrt(np.diag(slope @ covariance @ slope.T)) if tellable else np.full(3, _COM_SPREAD)
    body = Body(mass, read_only(com), read_only(about_com * mass))
    residual = np.sqrt((left**2).sum(axis=0) / np.maximum(used.sum(axis=0), 1))
    noise = np.sqrt(np.mean([log.torque_noise**2 for log in logs], axis=0))
    notes = tuple(dict.fromkeys(note for log in logs for note in log.notes))
    return PayloadFit(replace(boom, payload=body), float(np.sqrt(covariance[0, 0])), spread, residual, noise, notes)


def _rows(unknowns: Unknowns, log: Readings) -> tuple[Array, Array, Mask]:
    """Return columns of the payload (n, 5, 10), the torque (n, 5) to explain, and moving joints."""
    states = (log.q, log.qd, log.qdd)
    columns = unknowns.payload_rows(*states)
    return columns, log.tau - unknowns.rows(*states) @ unknowns.start, log.moving


def _variance(left: Array) -> float:
    if len(left) < 2:
        return 1.0
    return max(float(left @ left) / len(left) * autocorrelation_time(left), 1e-12)
