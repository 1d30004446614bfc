"""Identification of the boom's dynamics from measured motions and torques.

The torques are linear in the unknown parameters (`unknowns`). The fit is weighted least squares.
Each joint's weight is the inverse variance of its residual, found by iteration. Residuals of
neighbouring samples may be alike; the variance is therefore multiplied by the residual's integrated
autocorrelation time, 1 for white noise. The noise of the accelerations is in the regressor, and
makes inertias come out too small. What it adds to the normal equations on average is subtracted.

Two answers come of it. The *base parameters* are the combinations that torques can tell at all:
independent columns of the regressor over the whole workspace, by QR with column pivoting (Gautier
1990). They are fitted to the log alone. The *consistent fit* gives each body figures that a solid
can have (`consistency`), and stays near those of the boom's file where the log tells nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from boom_model import JOINTS, Basis, Boom, Origin, Sourced, breakdown
from boom_model.arrays import Array, read_only
from boom_model.boom import IS_LENGTH, LOAD_UNITS
from boom_model.dynamics.regressor import body_of_pseudo_inertia, body_parameters, pseudo_inertia_of_parameters
from boom_model.kinematics.linkage import within_reach
from boom_model.plausible import DRIVE_INERTIA
from planner.experiments.consistency import consistent_fit
from planner.experiments.log_checks import (
    delay_notes,
    require_plausible_positions,
    require_plausible_torques,
    residual_notes,
    rotor_notes,
)
from planner.experiments.readings import Readings
from planner.experiments.unknowns import IDENTIFIED_BODIES, Unknowns

HELD_OUT = 0.2
"""Share of each log, its end, that the fit does not see."""

BLOCK = 0.04
"""Length [s] of the blocks of samples whose rows are averaged before the fit."""

TOLD_APART = ("extension", "wrist")
"""Joints whose drive inertia has an effect of its own on the torques.

Those of the others look like an inertia of the link that they turn.
"""

_ITERATIONS = 6
_STATES = 1500
_INDEPENDENT = 1e-8  # relative to the largest column
_LAGS = 100
_EXACT = 1e-4  # share of its RMS to which a torque is known at best


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Combinations of parameters that the torques can tell, fitted to the log alone."""

    names: tuple[str, ...]
    """Parameter that leads each combination."""
    combinations: Array
    """(m, 90) K: the base parameters are K p."""
    values: Array
    """(m,) estimate"""
    covariance: Array
    """(m, m)"""
    start: Array
    """(m,) K p0, from the boom's file"""

    @property
    def deviations(self) -> Array:
        """(m,) standard deviations."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, eq=False)
class JointFit:
    """How well a model explains the torques of one joint; [Nm, the extension's N]."""

    joint: str
    unit: str
    before: float
    """RMS of the torques not explained by the boom's file, in what is held out"""
    after: float
    """the same by the identified boom"""
    noise: float
    """standard deviation of the torques from sample to sample"""
    seen: float
    """RMS of the torques not explained by the identified boom, in what the fit saw"""
    parts: dict[str, float]
    """RMS of each part of the identified torque over all samples, and of the residual"""


@dataclass(frozen=True, eq=False)
class Identification:
    """An identified boom, with what proves it."""

    unknowns: Unknowns
    x: Array
    """(90,) consistent fit; see `Unknowns`"""
    covariance: Array
    """(90, 90) of x"""
    base: BaseParameters | None
    """None where the log alone does not determine them"""
    told: int
    """Number of combinations that the log tells better than the boom's file does"""
    countable: int
    """Number of combinations that any motion could tell"""
    joints: tuple[JointFit, ...]
    duration: float
    """Of the logs [s]"""
    cutoff: float
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    """Faults of the logs that another measurement would avoid."""

    @cached_property
    def parameters(self) -> Array:
        """P (90,) of the consistent fit."""
        return self.unknowns.start + self.unknowns.transform @ self.x

    @cached_property
    def deviations(self) -> Array:
        """(90,) standard deviations of p."""
        T = self.unknowns.transform
        return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", T, self.covariance, T)))

    @cached_property
    def pseudo_inertias(self) -> Array:
        """(7, 4, 4) of IDENTIFIED_BODIES."""
        return pseudo_inertia_of_parameters(self.parameters[:70].reshape(7, 10))

    @cached_property
    def boom(self) -> Boom:
        """The identified boom."""
        bodies = {name: body_of_pseudo_inertia(P) for name, P in zip(IDENTIFIED_BODIES, self.pseudo_inertias, strict=True)}
        boom = with_dynamics(self.unknowns.boom, bodies, *self.parameters[75:].reshape(3, 5))
        return boom if self.drive_inertia is None else boom.with_drive_inertia(self._rotors(self.drive_inertia))

    def _rotors(self, inertia: Array) -> list[Sourced[float]]:
        """Drive inertias with what the torques tell of them.

        Of some joints, that is only the sum with the link's inertia.
        """
        found = []
        for i, joint in enumerate(JOINTS):
            shared = joint not in TOLD_APART
            said = "together with the link's inertia, which torques do not tell from it" if shared else ""
            source = said or f"to {self.deviations[70 + i]:.2g} {'kg' if IS_LENGTH[i] else 'kg m^2'}"
            found.append(Sourced(max(float(inertia[i]), DRIVE_INERTIA.low), Origin(Basis.MEASURED, source)))
        return found

    @property
    def drive_inertia(self) -> Array | None:
        """(5,) [kg m^2, the extension's kg]; None if the torques are those behind the gearboxes."""
        return self.parameters[70:75] if self.unknowns.drive_inertia else None


def with_dynamics(boom: Boom, bodies: dict[str, Any], viscous: Array, coulomb: Array, asymmetric: Array) -> Boom:
    """Return the boom with other bodies and another friction."""
    dry = np.maximum(coulomb, 0.0)  # the solver keeps its bounds to rounding
    friction = replace(
        boom.friction,
        viscous=read_only(np.maximum(viscous, 0.0)),
        coulomb=read_only(dry),
        asymmetric=read_only(np.clip(asymmetric, -dry, dry)),
    )
    return replace(boom, bodies=MappingProxyType(bodies), friction=friction)


@dataclass(frozen=True, eq=False)
class _Data:
    """Rows of each joint, averaged over blocks of samples, in the unknowns x."""

    rows: Array
    """(5, m, 90)"""
    right: Array
    """(5, m) torque that x must explain"""
    counts: Array
    """(5, m) samples of each block in which the joint moves"""
    scale: Array
    """(5,) RMS of the torques [Nm, N]"""
    noise: Array
    """(5, 90, 90) what the noise of the accelerations adds to the sum of squared rows"""

    def residual(self, x: Array) -> Array:
        """(5, m), times the square root of the count: of the variance of a sample."""
        left: Array = (self.right - self.rows @ x) * np.sqrt(self.counts)
        return left


def identify(boom: Boom, logs: Sequence[Readings], *, drive_inertia: bool = False) -> Identification:
    """Identify masses, centres of mass, inertias and friction.

    Args:
        boom: the boom with the payload that it carried; its figures are the starting point.
        logs: measured motions, as the joints read; the boom's calibration is applied. The last
            HELD_OUT of each is kept for validation.
        drive_inertia: whether the torques accelerate the drives' own inertia too, as those computed
            from motor currents do.

    Raises:
        InputError: positions are in another unit, or torques have the wrong sign, unit or side of
            the gearbox; the message says which.
        InfeasibleError: as `consistent_fit`.
    """
    logs = [log.calibrated(boom) for log in logs]
    seen = [log.part(slice(0, round((1.0 - HELD_OUT) * len(log.t)))) for log in logs]
    kept = [log.part(slice(round((1.0 - HELD_OUT) * len(log.t)), None)) for log in logs]
    require_plausible_positions(boom, logs)
    require_plausible_torques(boom, seen)
    scale = np.maximum(np.sqrt(np.mean(np.concatenate([log.tau for log in seen]) ** 2, axis=0)), 1e-3)
    unknowns = Unknowns(boom, drive_inertia, scale)
    data = _data(unknowns, seen)
    K, names = _base_combinations(unknowns)
    variance = np.ones(5)
    for _ in range(_ITERATIONS):
        H, b = _normal_equations(data, variance)
        variance = _variance(data, np.asarray(np.linalg.solve(H + np.eye(90), b)), H, variance)
    H, b = _normal_equations(data, variance)
    x = consistent_fit(unknowns, H + np.eye(90), b)
    covariance = np.asarray(np.linalg.inv(H + np.eye(90)))
    told = int((np.linalg.eigvalsh(H) > 1.0).sum())
    base = _base_fit(unknowns, K, names, H, b)
    found = Identification(
        unknowns, x, covariance, base, told, len(K), (), sum(log.t[-1] - log.t[0] for log in logs), logs[0].cutoff, (), ()
    )
    joints = _joint_fits(found, seen, kept)
    silent = () if told >= len(K) else (
        f"the logs tell {told} of {len(K)} combinations better than the boom's file does; the rest stay near the file. "
        "A longer motion of all joints tells more: boom identify --design",
    )  # fmt: skip
    notes = (
        *dict.fromkeys(note for log in logs for note in log.notes),
        *silent,
        *(() if drive_inertia else _rotor_notes(found, logs)),
    )
    warnings = (
        *residual_notes(np.array([joint.after for joint in joints]), np.array([joint.noise for joint in joints])),
        *delay_notes(*_delay(found, seen, data, H, variance)),
    )
    return replace(found, joints=joints, notes=notes, warnings=warnings)


def _data(unknowns: Unknowns, logs: Sequence[Readings]) -> _Data:
    parts = [_blocks(unknowns, log) for log in logs]
    rows, right, counts = (np.concatenate(arrays, axis=1) for arrays in zip(*parts, strict=True))
    noise = sum((_noise_of_rows(unknowns, log, part[2]) for log, part in zip(logs, parts, strict=True)), np.zeros((5, 90, 90)))
    return _Data(rows, right, counts, unknowns.torque_scale, noise)


def _blocks(unknowns: Unknowns, log: Readings) -> tuple[Array, Array, Array]:
    length = max(1, round(BLOCK / log.step))
    starts = np.arange(0, len(log.t), length)
    rows, right = np.empty((5, len(starts), 90)), np.empty((5, len(starts)))
    counts = np.add.reduceat(log.moving.astype(float), starts, axis=0).T
    per, payload = max(1, 2000 // length), body_parameters(unknowns.boom.payload)
    for first in range(0, len(starts), per):
        some = starts[first : first + per]
        part = slice(some[0], min(some[-1] + length, len(log.t)))
        states = (log.q[part], log.qd[part], log.qdd[part])
        used = log.moving[part]
        Y = unknowns.rows(*states) * used[..., None]
        tau = (log.tau[part] - unknowns.payload_rows(*states) @ payload) * used
        cuts = some - some[0]
        share = np.maximum(counts[:, first : first + per], 1.0)
        mean = np.add.reduceat(Y, cuts, axis=0).transpose(1, 0, 2) / share[..., None]
        rows[:, first : first + per] = mean @ unknowns.transform
        right[:, first : first + per] = np.add.reduceat(tau, cuts, axis=0).T / share - mean @ unknowns.start
    return rows, right, counts


def _noise_of_rows(unknowns: Unknowns, log: Readings, counts: Array) -> Array:
    """Return the expected sum (5, 90, 90) of c dY^T dY of each joint.

    dY is the error of its rows by noise in the accelerations. Rows are linear in qdd: dY = sum over
    joints k of dqdd_k dY/dqdd_k.
    """
    variance = log.acceleration_variance(BLOCK)
    some = slice(max(1, round(BLOCK / log.step)) // 2, None, max(1, round(BLOCK / log.step)))
    q, zero = log.q[some], np.zeros_like(log.q[some])
    counts = counts[:, : len(q)]
    still = unknowns.rows(q, zero, zero)
    found = np.zeros((5, 90, 90))
    for k in range(5):
        slope = (unknowns.rows(q, zero, zero + np.eye(5)[k]) - still) @ unknowns.transform
        weighted = slope * (variance[k] * counts.T)[..., None]
        found += np.einsum("njk,njl->jkl", slope, weighted, optimize=True)
    return found


def _normal_equations(data: _Data, variance: Array) -> tuple[Array, Array]:
    weighted = data.rows * (data.counts / variance[:, None])[..., None]
    H = np.einsum("jmk,jml->kl", data.rows, weighted, optimize=True) - np.tensordot(1.0 / variance, data.noise, axes=1)
    values, vectors = np.linalg.eigh(H)
    H = (vectors * np.maximum(values, 0.0)) @ vectors.T  # where the log holds noise alone it tells nothing
    return H, np.einsum("jmk,jm->k", weighted, data.right)


def _variance(data: _Data, x: Array, H: Array, weights: Array) -> Array:
    """Return the variance (5,) of a sample, less what the fit took up.

    It is multiplied by the autocorrelation time of the residual.
    """
    left, C = data.residual(x), np.linalg.inv(H + np.eye(90))
    found = np.empty(5)
    for j in range(5):
        used = data.counts[j] > 0.0
        r, rows = left[j, used], data.rows[j, used] * np.sqrt(data.counts[j, used, None])
        taken = np.einsum("mk,kl,ml->", rows, C, rows, optimize=True) / weights[j]
        found[j] = (r @ r) / max(len(r) - taken, 1.0) * autocorrelation_time(r) if len(r) else 1.0
    return np.maximum(found, (_EXACT * data.scale) ** 2)


def autocorrelation_time(r: Array) -> float:
    """Return 1 + 2 sum of the autocorrelations of r (n,), up to the first within its own noise."""
    energy, total = float(r @ r), 1.0
    if energy == 0.0:
        return total
    for lag in range(1, min(_LAGS, len(r) // 4)):
        rho = float(r[lag:] @ r[:-lag]) / energy
        if rho < 2.0 / np.sqrt(len(r)):
            break
        total += 2.0 * rho
    return total


def base_columns(boom: Boom) -> tuple[Array, Array]:
    """Return the columns (m,) of the regressor that base parameters lead, and their RMS (m,).

    The RMS is over the whole workspace. The torques are those behind the gearboxes.
    """
    _, chosen, sizes = _structure(boom, False)
    return np.array(chosen), sizes


def _delay(found: Identification, logs: Sequence[Readings], data: _Data, H: Array, variance: Array) -> tuple[float, float]:
    """Delay [s] of the torques' time stamps and its standard deviation, fitted together with x.

    A torque stamped d too late is tau(t - d), about tau - d dtau/dt. Most of that looks like other
    parameters; what does not tells the delay.
    """
    slopes = []
    for log in logs:
        rate = -np.gradient(found.unknowns.torque(found.parameters, log), log.step, axis=0) * log.moving
        starts = np.arange(0, len(log.t), max(1, round(BLOCK / log.step)))
        counts = np.add.reduceat(log.moving.astype(float), starts, axis=0)
        slopes.append((np.add.reduceat(rate, starts, axis=0) / np.maximum(counts, 1.0)).T)
    slope = np.concatenate(slopes, axis=1)
    weights = data.counts / variance[:, None]
    across = np.einsum("jmk,jm->k", data.rows, weights * slope)
    energy = float((weights * slope**2).sum() - across @ np.linalg.solve(H + np.eye(90), across))
    if energy <= 0.0:
        return 0.0, np.inf
    left = data.right - data.rows @ found.x
    C = np.linalg.solve(H + np.eye(90), np.einsum("jmk,jm->k", data.rows, weights * left))
    return float((weights * slope * left).sum() - across @ C) / energy, 1.0 / np.sqrt(energy)


def _base_combinations(unknowns: Unknowns) -> tuple[Array, tuple[str, ...]]:
    """K (m, 90) and the leading parameters, from the regressor over the whole workspace."""
    K, chosen, _ = _structure(unknowns.boom, unknowns.drive_inertia)
    return K, tuple(unknowns.names[i] for i in chosen)


@lru_cache(maxsize=8)
def _structure(boom: Boom, drive_inertia: bool) -> tuple[Array, tuple[int, ...], Array]:
    from scipy.linalg import qr

    unknowns = Unknowns(boom, drive_inertia, np.ones(5))
    rng, limits = np.random.default_rng(0), boom.limits
    q = rng.uniform(limits.lower, limits.upper, (_STATES, 5))
    q[:, 2] = rng.uniform(np.maximum(limits.lower[2], q[:, 1] + limits.linkage), limits.upper[2])
    q = within_reach(boom, q, limits.linkage)
    qd, qdd = (rng.uniform(-1.0, 1.0, (_STATES, 5)) * size for size in (limits.velocity, limits.acceleration))
    Y = unknowns.rows(q, qd, qdd).reshape(-1, 90)
    norms = np.linalg.norm(Y, axis=0)
    if not drive_inertia:
        norms[70:75] = 0.0
    columns = np.flatnonzero(norms > _INDEPENDENT * norms.max())
    R, order = qr(Y[:, columns] / norms[columns], mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    m = int((size > _INDEPENDENT * size[0]).sum())
    K = np.zeros((m, 90))
    chosen = columns[order]
    K[np.arange(m), chosen[:m]] = 1.0
    weights = np.linalg.solve(R[:m, :m], R[:m, m:])
    K[:, chosen[m:]] = weights * norms[chosen[m:]] / norms[chosen[:m], None]
    K[np.abs(K) < 1e-9] = 0.0
    return K, tuple(int(i) for i in chosen[:m]), norms[chosen[:m]] / np.sqrt(_STATES)


def _base_fit(unknowns: Unknowns, K: Array, names: tuple[str, ...], H: Array, b: Array) -> BaseParameters | None:
    """Least squares of the base parameters alone; None if the log does not determine them.

    The torque of any x is that of K T x, so x = (K T)^+ (b - b0) is as good as any other x with
    these base parameters.
    """
    inverse = np.linalg.pinv(K @ unknowns.transform)
    N = inverse.T @ H @ inverse
    scale = 1.0 / np.sqrt(np.maximum(np.diag(N), 1e-300))
    scaled = N * np.outer(scale, scale)
    if not np.linalg.cond(scaled) < 1e12:
        return None
    covariance = np.linalg.inv(scaled) * np.outer(scale, scale)
    start = K @ unknowns.start
    return BaseParameters(names, K, start + covariance @ (inverse.T @ b), covariance, start)


def _joint_fits(found: Identification, seen: Sequence[Readings], kept: Sequence[Readings]) -> tuple[JointFit, ...]:
    unknowns, fits = found.unknowns, []

    def unexplained(p: Array, logs: Sequence[Readings]) -> Array:
        squares, count = np.zeros(5), np.zeros(5)
        for log in logs:
            left = (log.tau - unknowns.torque(p, log)) * log.moving
            squares += (left**2).sum(axis=0)
            count += log.moving.sum(axis=0)
        return np.sqrt(squares / np.maximum(count, 1.0))

    before, after = (unexplained(p, kept) for p in (unknowns.start, found.parameters))
    inside = unexplained(found.parameters, seen)
    noise = np.sqrt(np.mean([log.torque_noise**2 for log in seen], axis=0))
    parts = _parts(found, [*seen, *kept])
    for i, joint in enumerate(JOINTS):
        each = {name: float(np.sqrt(np.mean(values[:, i] ** 2))) for name, values in parts.items()}
        fits.append(JointFit(joint, LOAD_UNITS[i], float(before[i]), float(after[i]), float(noise[i]), float(inside[i]), each))
    return tuple(fits)


def _rotor_notes(found: Identification, logs: Sequence[Readings]) -> tuple[str, ...]:
    left = [(log.tau - found.unknowns.torque(found.parameters, log)) * log.moving for log in logs]
    noise = np.sqrt(np.mean([log.torque_noise**2 for log in logs], axis=0))
    return rotor_notes(np.concatenate(left), np.concatenate([log.qdd * log.moving for log in logs]), noise)


def _parts(found: Identification, logs: Sequence[Readings]) -> dict[str, Array]:
    boom, rotors = found.boom, found.parameters[70:75]
    listed = []
    for log in logs:
        parts = breakdown(boom, log.q, log.qd, log.qdd, friction=True)
        each = {name: getattr(parts, name) for name in ("gravity", "inertia", "velocity", "payload", "friction")}
        each["drive inertia"] = rotors * log.qdd
        each["residual"] = (log.tau - sum(each.values())) * log.moving
        listed.append(each)
    return {name: np.concatenate([each[name] for each in listed]) for name in listed[0]}


def to_json(found: Identification, files: dict[str, str]) -> dict[str, Any]:
    """Return the JSON object of `boom identify`, in SI."""
    p, deviations = found.parameters, found.deviations
    base = found.base
    return {
        "duration_s": found.duration,
        "cutoff_Hz": found.cutoff,
        "told": found.told,
        "base_parameters": found.countable,
        "joints": [vars(joint) for joint in found.joints],
        "parameters": [
            {"name": name, "value": float(p[i]), "deviation": float(deviations[i]), "start": float(found.unknowns.start[i])}
            for i, name in enumerate(found.unknowns.names)
            if found.unknowns.active[i]
        ],
        "base": None
        if base is None
        else [
            {"name": name, "value": float(value), "deviation": float(sigma), "start": float(start)}
            for name, value, sigma, start in zip(base.names, base.values, base.deviations, base.start, strict=True)
        ],
        "notes": [*found.notes, *found.warnings],
        "warnings": list(found.warnings),
        "files": files,
    }
