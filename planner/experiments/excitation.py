"""Motions that tell the most about the dynamics: periodic, rest to rest, within the boom's limits.

Each joint follows a Fourier series of H harmonics (Swevers and others 1997):

    q(t) = q0 + sum over k of a_k sin(k w t) + b_k (cos(k w t) - 1),    sum k a_k = sum k^2 b_k = 0

The two sums make velocity and acceleration 0 at the start and the end of each period, so the motion
can be planned to, and repeated. Let Y be the regressor of the base parameters along the motion,
each column divided by its RMS over the whole workspace. The design either minimises the condition
number of Y, which says how evenly the motion tells the parameters, or maximises log det Y^T Y,
which says how much it tells.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from boom_model import Boom, InfeasibleError, InputError, inverse_dynamics
from boom_model.arrays import Array
from boom_model.kinematics.linkage import within_reach
from planner.experiments.identification import base_columns
from planner.experiments.unknowns import Unknowns
from planner.motion.trajectory import Trajectory
from planner.progress import Track
from planner.timing.limit_ratios import Limit, limit_ratios

Criterion = Literal["condition", "information"]

PERIOD, HARMONICS = 20.0, 5
STEP = 0.01
"""Sampling step [s] of the motion."""

ROUNDS = 40
"""Largest number of iterations of a design, for each of its criteria."""

_POINTS = 48  # of a period, at which the criterion looks
_FINE = 4000
_STARTS = 12
_PENALTY, _TARGET = 300.0, 0.985
"""Weight of what is beyond the limits, and the ratio from which on it counts; what is left of it
costs amplitude."""

_DIFFERENCE = 1e-6
_SMOOTH = 0.03
_FROM_REACH = np.radians(0.5)
"""Unequal links do not close beyond their reach. What the optimiser tries there is given the loads
of half a degree before it."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """A periodic motion; see the module."""

    boom: Boom
    period: float
    """[s]"""
    centre: Array
    """(5,) q0"""
    sines: Array
    """(H, 5) a"""
    cosines: Array
    """(H, 5) b"""

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        """Return q, qd and qdd (n, 5) at times t (n,)."""
        w = 2.0 * np.pi / self.period * np.arange(1, len(self.sines) + 1)
        c, s = np.cos(np.outer(t, w)), np.sin(np.outer(t, w))
        a, b = self.sines, self.cosines
        return self.centre + s @ a + (c - 1.0) @ b, (c * w) @ a - (s * w) @ b, -(s * w**2) @ a - (c * w**2) @ b

    @cached_property
    def trajectory(self) -> Trajectory:
        """One period, sampled."""
        t = np.linspace(0.0, self.period, round(self.period / STEP) + 1)
        return Trajectory.from_samples(t, *self(t), notes=("excitation for boom identify; it may be repeated",))

    def worst_ratio(self) -> float:
        """Return the largest ratio to any limit on a fine grid."""
        return float(_ratios(self.boom, *self(np.linspace(0.0, self.period, _FINE + 1))).max())


def condition_number(boom: Boom, motion: tuple[Array, Array, Array]) -> float:
    """Return the condition number of the regressor Y along states q, qd, qdd (n, 5).

    It is infinite if Y lacks a combination.
    """
    values = np.linalg.eigvalsh(_information(boom, *motion))
    return float(np.sqrt(values[-1] / values[0])) if values[0] > 1e-14 * values[-1] else float("inf")


def log_information(boom: Boom, motion: tuple[Array, Array, Array]) -> float:
    """Return log det of the mean Y^T Y along states q, qd, qdd (n, 5).

    The noise of the torques is 1 Nm and 1 N.
    """
    return float(np.linalg.slogdet(_information(boom, *motion))[1])


def design(
    boom: Boom,
    *,
    criterion: Criterion = "condition",
    period: float = PERIOD,
    harmonics: int = HARMONICS,
    seed: int = 0,
    rounds: int = ROUNDS,
    track: Track = iter,
) -> Excitation:
    """Return the best motion, by BFGS from the best of some random ones, with a penalty for limits.

    The limits are those of positions, lower - inner, velocities, accelerations and drive torques.

    Args:
        boom: the boom with its payload.
        criterion: what is best; see the module.
        period: [s]
        harmonics: H
        seed: of the random motions.
        rounds: largest number of iterations, of each criterion.
        track: shows progress over the iterations.

    Raises:
        InputError: fewer than 3 harmonics, or the period is not above 0.
        InfeasibleError: no random motion keeps the limits.
    """
    from scipy.optimize import minimize

    if harmonics < 3 or not period > 0.0:
        raise InputError(f"{harmonics} harmonics in {period:g} s: at least 3 harmonics and a period above 0 s are needed")
    rng = np.random.default_rng(seed)
    starts = [random_excitation(boom, rng, period=period, harmonics=harmonics) for _ in range(_STARTS)]
    # The condition number is flat far from its least; the way there begins with the information.
    phases = [_Problem(boom, each, period, harmonics) for each in dict.fromkeys(("information", criterion))]
    best = min(starts, key=lambda each: phases[0].cost(phases[0].variables(each)))
    x, done = phases[0].variables(best), iter(track(list(range(rounds * len(phases)))))
    for problem in phases:
        options = {"maxiter": rounds, "ftol": 1e-5}

        def told(_: Array) -> None:
            next(done, None)

        # scipy's stubs lack a cost that returns its slope too
        x = minimize(problem.cost_and_slope, x, (), "L-BFGS-B", True, options=options, callback=told).x  # type: ignore[call-overload]
    for _ in done:
        pass
    improved = _within_limits(phases[-1].excitation(x))
    return best if improved is None or _worse(criterion, improved, best) else improved


def random_excitation(
    boom: Boom, rng: np.random.Generator, *, period: float = PERIOD, harmonics: int = HARMONICS
) -> Excitation:
    """Return a random motion, as large as the limits allow.

    Raises:
        InfeasibleError: 100 motions break a limit however small they are.
    """
    limits = boom.limits
    basis = _basis(harmonics)
    for _ in range(100):
        q0 = rng.uniform(limits.lower, limits.upper)
        q0[2] = rng.uniform(min(q0[1] + limits.linkage, limits.upper[2]), limits.upper[2])
        a, b = (each @ rng.normal(size=(each.shape[1], 5)) for each in basis)
        w = 2.0 * np.pi / period * np.arange(1, harmonics + 1)[:, None]
        size = np.minimum(limits.velocity / (np.hypot(a, b) * w).sum(axis=0), (limits.upper - limits.lower) / 2.0)
        found = _within_limits(Excitation(boom, period, q0, a * size, b * size))
        if found is not None:
            return found
    raise InfeasibleError("no random motion keeps the limits: the drives cannot hold the boom in most of its workspace")


def _within_limits(motion: Excitation) -> Excitation | None:
    """Return the motion, its amplitude reduced to keep the limits; None if it must stand still."""
    t = np.linspace(0.0, motion.period, _FINE + 1)
    offset = motion(t)[0].mean(axis=0) - motion.centre

    def scaled(k: float) -> Excitation:
        # about the mean, which stays
        return replace(motion, centre=motion.centre + (1.0 - k) * offset, sines=k * motion.sines, cosines=k * motion.cosines)

    if motion.worst_ratio() <= 1.0:
        return motion
    # Downwards in steps: holding the mean position may load a drive more than passing it does.
    for k in np.arange(0.99, 0.02, -0.02):
        found = scaled(float(k))
        if _ratios(motion.boom, *found(t[::16])).max() <= 1.0 and found.worst_ratio() <= 1.0:
            return found
    return None


def _worse(criterion: Criterion, a: Excitation, b: Excitation) -> bool:
    one, other = (each(np.linspace(0.0, each.period, 4 * _POINTS, endpoint=False)) for each in (a, b))
    if criterion == "condition":
        return condition_number(a.boom, one) > condition_number(b.boom, other)
    return log_information(a.boom, one) < log_information(b.boom, other)


def _basis(harmonics: int) -> tuple[Array, Array]:
    """Return columns (H, H - 1) of the a with sum k a_k = 0 and of the b with sum k^2 b_k = 0.

    They are orthonormal before row k is divided by k.
    """
    from scipy.linalg import null_space

    k = np.arange(1.0, harmonics + 1.0)
    # The higher harmonics are damped, so that a step of any variable changes the accelerations
    # alike.
    return tuple(null_space((k**power / k)[None]) / k[:, None] for power in (1, 2))  # type: ignore[return-value]


def _ratios(boom: Boom, q: Array, qd: Array, qdd: Array) -> Array:
    """Ratios (kinds, n, 5) to every limit."""
    tau = inverse_dynamics(boom, within_reach(boom, q, _FROM_REACH), qd, qdd, friction=True, reactions=False).tau
    ratios = limit_ratios(boom, q, qd, qdd, None, tau)
    short = np.zeros_like(q)
    short[:, 2] = 1.0 + boom.limits.linkage - (q[:, 2] - q[:, 1])  # 1 at the limit, as the ratio, but smooth beyond it
    return np.stack([*(ratio for limit, ratio in ratios.items() if limit is not Limit.LINKAGE), short])


def _scaled_regressor(boom: Boom, q: Array, qd: Array, qdd: Array) -> Array:
    """Y (n, 5, m) at states (n, 5)."""
    columns, sizes = _columns(boom)
    q = within_reach(boom, q, _FROM_REACH)
    direction = np.tanh(qd / (_SMOOTH * boom.limits.velocity))  # so that the cost is smooth
    return Unknowns(boom, False, np.ones(5)).rows(q, qd, qdd, direction)[..., columns] / sizes


def _information(boom: Boom, q: Array, qd: Array, qdd: Array) -> Array:
    Y = _scaled_regressor(boom, q, qd, qdd)
    return np.asarray(np.einsum("njk,njl->kl", Y, Y, optimize=True) / len(q))


@lru_cache(maxsize=8)
def _columns(boom: Boom) -> tuple[Array, Array]:
    """Columns of the base parameters of equal links.

    What unequal ones show besides is too weak to design for.
    """
    return base_columns(replace(boom, geometry=replace(boom.geometry, upper_less_lower=0.0, inner_less_outer=0.0)))


@dataclass(frozen=True, eq=False)
class _Problem:
    """The design as a nonlinear program in q0 and the coefficients on the bases of a and b."""

    boom: Boom
    criterion: Criterion
    period: float
    harmonics: int

    def variables(self, motion: Excitation) -> Array:
        parts = [np.linalg.pinv(basis) @ x for basis, x in zip(self._bases, (motion.sines, motion.cosines), strict=True)]
        return np.concatenate([motion.centre, *(part.ravel() for part in parts)])

    def excitation(self, x: Array) -> Excitation:
        a, b = x[5:].reshape(2, self.harmonics - 1, 5)
        return Excitation(self.boom, self.period, x[:5], self._bases[0] @ a, self._bases[1] @ b)

    def cost(self, x: Array) -> float:
        return float(self._costs(x[None])[0])

    def cost_and_slope(self, x: Array) -> tuple[float, Array]:
        costs = self._costs(np.concatenate([x[None], x + _DIFFERENCE * np.eye(len(x))]))
        return float(costs[0]), (costs[1:] - costs[0]) / _DIFFERENCE

    @cached_property
    def _bases(self) -> tuple[Array, Array]:
        return _basis(self.harmonics)

    def _states(self, xs: Array, points: int) -> tuple[Any, ...]:
        """q, qd and qdd (len(xs), points, 5)."""
        t = (np.arange(points) + 0.5) * self.period / points
        return tuple(np.stack(each) for each in zip(*(self.excitation(x)(t) for x in xs), strict=True))

    def _costs(self, xs: Array) -> Array:
        q, qd, qdd = self._states(xs, _POINTS)
        flat = (each.reshape(-1, 5) for each in (q, qd, qdd))
        Y = _scaled_regressor(self.boom, *flat)
        Y = Y.reshape(len(xs), -1, Y.shape[-1])
        values = np.linalg.eigvalsh(np.swapaxes(Y, -1, -2) @ Y / _POINTS)
        values = np.maximum(values, 1e-14 * values[:, -1:])
        if self.criterion == "condition":
            # smooth where eigenvalues meet, and nearly that of the largest and the smallest
            costs = 0.5 * (np.log(values.sum(axis=1)) + np.log((1.0 / values).sum(axis=1)))
        else:
            costs = -np.log(values).sum(axis=1) / values.shape[1]
        return np.asarray(costs + _PENALTY * self._beyond((q, qd, qdd)))

    def _beyond(self, states: tuple[Array, Array, Array]) -> Array:
        """How far states (m, points, 5) are beyond the limits, (m,)."""
        ratios = _ratios(self.boom, *(each.reshape(-1, 5) for each in states))
        over = np.clip(ratios.reshape(len(ratios), *states[0].shape) - _TARGET, 0.0, 10.0)
        beyond: Array = (over**2).mean(axis=2).sum(axis=(0, 2))
        return beyond
