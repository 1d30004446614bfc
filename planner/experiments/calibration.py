"""Calibration of the boom's geometry from measured tip positions, by nonlinear least squares.

Each pose contributes its residual, measured less predicted, divided by its standard deviation.

1. A fit with Cauchy's loss finds the geometry in spite of bad targets. A pose that is then farther
   off than chance allows is left out, by name.
2. The derivative's columns are scaled by `TOLERANCE`, the error expected of each parameter. A
   singular value s means that the data determine its direction to 1/s tolerances. While the least
   one is below 1, the data tell less than is known beforehand: a parameter of that direction is
   held at the value of the boom's file, and named with those that it cannot be told from.
3. Least squares on the remaining poses and parameters give values and the covariance (J^T J)^-1,
   times the residuals' variance where that exceeds the stated one, or where none is stated.
4. The residual of a pose that had been left out of the fit is (I - H)^-1 r, with the pose's block H
   of the hat matrix. This is the held-out error.

Equal links, L5 = L3 and L9 = L4, are a hypothesis with fewer parameters. It is rejected where the F
test of its larger residuals says so at 1 %. Sources: Hollerbach, Khalil and Gautier, "Model
Identification" (Handbook of Robotics, ch. 6); Huber, "Robust Statistics".
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.stats import chi2, f

from boom_model import Basis, Boom, InfeasibleError, InputError, Origin
from boom_model.arrays import Array, Mask, checked, read_only
from boom_model.calibration import INNER, SCALE, UPPER, WIND_UPS, Calibration
from boom_model.tip_uncertainty import printed_wind_up
from planner.experiments.calibration_model import (
    BASE,
    SIDEWAYS,
    TOLERANCE,
    TipModel,
    aligned,
    candidates,
    require_a_shape,
)
from planner.experiments.measurement_checks import require_plausible_tips, still_notes
from planner.experiments.measurements import Measurements

Linkage = Literal["auto", "equal", "unequal"]

USUAL_SD = 1e-3
"""Standard deviation [m] of a coordinate from which a fit of unknown noise starts."""

_HELD_FIRST = ("extension offset", "yaw offset", "L1", "L3", *WIND_UPS, SCALE, SIDEWAYS, "wrist offset", UPPER, INNER)
"""Parameters that are held before others that the data cannot tell them from."""

_SHARE = 0.3  # of the largest component of a direction, from which a parameter takes part in it
_PLACED = 3  # poses with three coordinates that tell the place of the boom
_STARTS = 3  # fits with the noise or the wind-up of the one before
_REJECTED = 0.001  # chance that a set of good poses loses one
_LARGEST_REJECTED = 0.25
_DOUBT = 0.01


@dataclass(frozen=True, eq=False)
class Parameter:
    """One figure of a calibration, in SI."""

    name: str
    start: float
    value: float
    sd: float | None
    """Standard deviation; None if the parameter is held."""
    alike: tuple[str, ...] = ()
    """Parameters that the data cannot tell it from, where it is held."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What measured tips tell of a boom."""

    boom: Boom
    """With the measured lengths and `calibration`."""
    start: Boom
    """As it was before."""
    model: TipModel
    """With the place of the boom in the measuring frame."""
    parameters: tuple[Parameter, ...]
    """But those of the place."""
    free: tuple[str, ...]
    """Parameters that were fitted, the rows of `covariance`."""
    covariance: Array
    singular_values: Array
    """Of the fitted parameters' derivative, in tolerances; all are at least 1."""
    dropped_values: Array
    """The least singular value each time that a parameter was held."""
    residuals: Array
    """(n, 3) measured less predicted [m], NaN where not measured"""
    held_out: Array
    """(n, 3) the same of each pose as if it had not been used [m]"""
    before: Array
    """(n, 3) the same with the boom as it was, in its best place [m]"""
    used: Mask
    """(n,) False for poses left out as bad."""
    sd_factor: float
    """Residuals' standard deviation over the stated one."""
    widened: bool
    """Whether the intervals are wider than the stated noise makes them."""
    stated: bool
    """Whether the measurements state their standard deviation."""
    equal_links_rms: float | None
    """RMS residual with equal links forced [m]; None if not tried."""
    equal_links_chance: float | None
    """Probability of residuals that much larger if the links were equal."""
    notes: tuple[str, ...]
    """What was found and left out."""
    interval_notes: tuple[str, ...]
    """Why the intervals are wider than the stated noise makes them."""

    @property
    def unequal(self) -> bool:
        """Whether the links of the linkage differ."""
        return not self.boom.geometry.is_parallelogram

    @property
    def held_out_rms(self) -> float:
        """RMS distance of the used poses, each as if it had not been used [m]."""
        return rms(self.held_out[self.used])

    def predicted(self, readings: ArrayLike) -> tuple[Array, Array]:
        """Return tip positions (n, 3) and their covariance (n, 3, 3) at readings (n, 5).

        Both are in the measuring frame.

        Raises:
            InputError: readings are not finite or not (n, 5).
        """
        q = np.atleast_2d(checked("readings", readings, 5))
        yields = printed_wind_up(self.model.boom, self.model.joints(q, np.zeros_like(q)))
        J = self.model.derivative(self.free, q, yields)
        return self.model.tip(q, yields), J @ self.covariance @ np.swapaxes(J, -1, -2)

    def checked_on(self, other: Measurements) -> "Check":
        """Return how well tips that were not used are predicted, in the same frame.

        Raises:
            InputError: fewer than 3 poses have all three coordinates, or all tips are on one line.
        """
        at, C = self.predicted(other.readings)
        start = TipModel.of(self.start, self.model.target)
        yields = printed_wind_up(start.boom, start.joints(other.readings, np.zeros_like(other.readings)))
        if set(BASE) & set(self.free):
            start = _placed(other, start, yields)
        before = other.seen(start.tip(other.readings, yields))
        R = other.across(at, np.broadcast_to(np.eye(3), C.shape))
        C, at = R @ C @ np.swapaxes(R, -1, -2), other.seen(at)
        spread = np.sqrt(np.trace(C, axis1=1, axis2=2).mean())
        if other.tip_sd is not None:
            noise = np.square(np.where(np.isfinite(other.tip), other.tip_sd, 0.0)).sum(axis=-1)
            spread = np.sqrt(spread**2 + noise.mean())
        return Check(len(other.tip), rms(other.tip - before), rms(other.tip - at), float(spread))


@dataclass(frozen=True)
class Check:
    """Errors of tips that a calibration has not used, RMS distances [m]."""

    poses: int
    before: float
    """Of the boom before, in its best place."""
    after: float
    expected: float
    """From the covariance, and the stated noise where there is one."""


def rms(errors: Array) -> float:
    """Return the RMS distance [m] over poses (n, 3); what was not measured counts as 0."""
    return float(np.sqrt(np.nanmean(np.nansum(np.square(errors), axis=-1)))) if len(errors) else float("nan")


def calibrate(
    boom: Boom,
    measured: Measurements,
    *,
    known_frame: bool = False,
    linkage: Linkage = "auto",
    target: ArrayLike = (0.0, 0.0, 0.0),
    held: Iterable[str] = (),
) -> Calibrated:
    """Fit the geometry of a boom to measured tips.

    Args:
        boom: the boom to start from; its payload hangs at the tip during the measurement.
        measured: readings and tips.
        known_frame: whether the tips are in frame 1; otherwise the boom's place is fitted as well.
        linkage: "unequal" and "equal" decide whether opposite links may differ; "auto" lets them
            differ where the data reject equal links.
        target: (3,) measured target in frame 11 [m].
        held: parameters that keep the values of the boom's file.

    Raises:
        InputError: too few poses, poses that differ in too little, or an unknown parameter; the
            message says what to measure instead.
    """
    target = checked("target", target)
    if target.shape != (3,):
        raise InputError(f"target has shape {target.shape}; it must be (3,)")
    start, fixed = TipModel.of(boom, target), frozenset(held)
    every = candidates(boom, known_frame=known_frame, equal_links=False)
    for name in fixed:
        if name not in every:
            raise InputError(f"unknown parameter {name!r}; there are: {', '.join(every)}")
    _require_enough(measured)
    if linkage == "equal" and not boom.geometry.is_parallelogram:
        equal = replace(boom.geometry, upper_less_lower=0.0, inner_less_outer=0.0)
        start = replace(start, boom=replace(boom, geometry=equal))
    require_plausible_tips(measured, start, known_frame)
    if linkage != "equal":
        require_a_shape(start, measured.readings)
    names = {kind: _candidates(boom, known_frame, kind == "equal", fixed) for kind in ("equal", "unequal")}
    if linkage == "equal" or not {UPPER, INNER} & set(names["unequal"]):
        return _result(measured, start, _fitted(measured, start, names["equal"], known_frame), linkage, None, None)
    general = _fitted(measured, start, names["unequal"], known_frame)
    if not start.boom.geometry.is_parallelogram:
        return _result(measured, start, general, linkage, None, None)
    plain = _fitted(measured, start, names["equal"], known_frame, used=general.used)
    chance = _chance(plain, general)
    kept = plain if linkage == "auto" and chance > _DOUBT else general
    return _result(measured, start, kept, linkage, rms(plain.residuals[plain.used]), chance)


_Dropped = tuple[str, tuple[str, ...], float]
"""A parameter that is held, those that it is like, and the singular value of their direction."""


@dataclass(frozen=True, eq=False)
class _Fit:
    model: TipModel
    names: tuple[str, ...]
    covariance: Array
    """Without the factor of the noise."""
    singular: Array
    dropped: tuple[_Dropped, ...]
    residuals: Array
    held_out: Array
    before: Array
    used: Mask
    square: float
    """Sum of the squared residuals, each over its standard deviation."""
    freedom: int
    sd: float
    """Standard deviation that the fit has assumed, over the stated one."""

    @property
    def factor(self) -> float:
        """Residuals' standard deviation over the stated one."""
        return float(self.sd * np.sqrt(self.square / self.freedom))


def _candidates(boom: Boom, known_frame: bool, equal: bool, fixed: frozenset[str]) -> tuple[str, ...]:
    return tuple(name for name in candidates(boom, known_frame=known_frame, equal_links=equal) if name not in fixed)


def _require_enough(measured: Measurements) -> None:
    count, moved = int(np.isfinite(measured.tip).sum()), np.ptp(measured.readings, axis=0) if len(measured.readings) else None
    if moved is None or count < 24:
        raise InputError(
            f"{measured.name}: {len(measured.readings)} poses with {count} coordinates are too few; "
            "measure at least 10 poses, better 30 (boom calibrate --suggest 30)"
        )
    if not moved.any():
        raise InputError(f"{measured.name}: no joint moves; measure poses that differ in every joint (--suggest)")


def _fitted(
    measured: Measurements, start: TipModel, names: tuple[str, ...], known_frame: bool, used: Mask | None = None
) -> _Fit:
    """Return the fit, repeated with the wind-up and the noise of the one before."""
    readings, model = measured.readings, start
    yields = printed_wind_up(model.boom, model.joints(readings, np.zeros_like(readings)))
    if not known_frame:
        model = _placed(measured, model, yields)
    before = measured.tip - measured.seen(model.tip(readings, yields))
    sd, good, found = 1.0, used, None
    everything = np.ones(len(readings), dtype=bool)
    for _ in range(_STARTS):
        whiten = _Whitened(measured, model, yields, sd)
        robust = _solve(whiten, model, _told(whiten, model, names)[0], everything, "cauchy")
        if used is None:
            good = _good(whiten, robust, len(names))
        assert good is not None
        free, dropped, singular = _told(whiten, robust, names, good)
        model = _solve(whiten, robust, free, good, "linear")
        found = _closed(whiten, model, free, dropped, singular, good, before, sd)
        yields = printed_wind_up(model.boom, model.joints(readings, np.zeros_like(readings)))
        if measured.tip_sd is None:
            sd = max(found.factor, 1e-6)
    assert found is not None
    return found


def _placed(measured: Measurements, model: TipModel, yields: Array) -> TipModel:
    """Return the model in its best place: by the tips, or by distances from where it stands."""
    tips = model.tip(measured.readings, yields)
    if not measured.by_distance.any() or np.isfinite(measured.tip).all(axis=-1).sum() >= _PLACED:
        return replace(model, frame=aligned(tips, measured.tip))
    everything = np.ones(len(tips), dtype=bool)
    return _solve(_Whitened(measured, model, yields, 1.0), model, BASE, everything, "cauchy")


class _Whitened:
    """Residuals in standard deviations, of the tip and, through the derivative, of the readings."""

    def __init__(self, measured: Measurements, model: TipModel, yields: Array, sd: float) -> None:
        self.measured, self.yields, self.sd = measured, yields, sd
        self.finite = np.isfinite(measured.tip)
        n = len(measured.tip)
        spread = np.full((n, 3), USUAL_SD * sd) if measured.tip_sd is None else np.array(measured.tip_sd)
        C = np.zeros((n, 3, 3))
        C[:, range(3), range(3)] = spread**2
        if measured.reading_sd.any():
            J = measured.across(model.tip(measured.readings, yields), model.by_readings(measured.readings, yields))
            C += (J * measured.reading_sd[:, None, :] ** 2) @ np.swapaxes(J, -1, -2)
        gone = ~self.finite
        C[gone[:, :, None] | gone[:, None, :]] = 0.0
        C[:, range(3), range(3)] += gone
        self.inverse = np.linalg.inv(np.linalg.cholesky(C))

    def residuals(self, model: TipModel) -> Array:
        """Return the residuals (n, 3), 0 where not measured."""
        seen = self.measured.seen(model.tip(self.measured.readings, self.yields))
        off = np.where(self.finite, self.measured.tip - seen, 0.0)
        return np.asarray((self.inverse @ off[..., None])[..., 0])

    def derivative(self, model: TipModel, names: tuple[str, ...]) -> Array:
        """Of the prediction, (n, 3, k), each column in tolerances of its parameter."""
        J = model.derivative(names, self.measured.readings, self.yields) * np.array([TOLERANCE[name] for name in names])
        J = self.measured.across(model.tip(self.measured.readings, self.yields), J)
        return np.asarray(self.inverse @ np.where(self.finite[..., None], J, 0.0))


def _solve(
    whiten: _Whitened, model: TipModel, names: tuple[str, ...], good: Mask, loss: Literal["linear", "cauchy"]
) -> TipModel:
    unit = np.array([TOLERANCE[name] for name in names])

    def residuals(x: Array) -> Array:
        try:
            return np.asarray(whiten.residuals(model.changed(names, x * unit))[good].ravel())
        except (InfeasibleError, InputError):  # no such boom: the solver takes a shorter step
            return np.full(3 * int(good.sum()), np.nan)

    def derivative(x: Array) -> Array:
        return np.asarray(-whiten.derivative(model.changed(names, x * unit), names)[good].reshape(-1, len(names)))

    whiten.residuals(model)  # raises where the start is no possible boom
    found = least_squares(residuals, np.zeros(len(names)), derivative, loss=loss, f_scale=3.0, xtol=1e-10, ftol=1e-12)
    return model.changed(names, found.x * unit)


def _good(whiten: _Whitened, model: TipModel, count: int) -> Mask:
    """Return the poses whose residual is no more than chance allows, whatever the true noise is."""
    square = np.square(whiten.residuals(model)).sum(axis=-1)
    known = whiten.finite.sum(axis=-1)
    total = int(known.sum())
    share = max(1.0 - count / total, 0.2)  # of the noise that the fit leaves in the residuals
    scale = float(np.median(square / chi2.ppf(0.5, known)))
    if whiten.measured.tip_sd is not None:
        scale = max(scale, share)
    bad = square > max(scale, 1e-300) * chi2.ppf(1.0 - _REJECTED / len(square), known) / min(share, 1.0)
    if bad.mean() > _LARGEST_REJECTED:
        bad[:] = False
    return np.asarray(~bad)


def _told(
    whiten: _Whitened, model: TipModel, names: tuple[str, ...], good: Mask | None = None
) -> tuple[tuple[str, ...], tuple[_Dropped, ...], Array]:
    """Return the parameters that the data tell, those held, and the singular values.

    A held parameter says what it is like, and how badly the data tell it.
    """
    J = whiten.derivative(model, names)
    J = (J if good is None else J[good]).reshape(-1, len(names))
    free, dropped = list(names), list[_Dropped]()
    while True:
        columns = [names.index(name) for name in free]
        _, singular, Vt = np.linalg.svd(J[:, columns], full_matrices=len(columns) > len(J))
        sizes = np.zeros(len(columns))
        sizes[: len(singular)] = singular
        least = int(np.argmin(sizes))
        if sizes[least] >= 1.0:
            return tuple(free), tuple(dropped), sizes
        parts = np.abs(Vt[least])
        involved = [name for name, part in zip(free, parts, strict=True) if part >= _SHARE * parts.max()]
        held = next((name for name in (*_HELD_FIRST, *free) if name in involved and name not in BASE), involved[0])
        free.remove(held)
        dropped.append((held, _alike(J, names, held, free), float(sizes[least])))
        if not free:
            raise InputError(
                f"{whiten.measured.name}: the poses tell nothing of the boom; measure poses that differ in each joint"
            )


def _alike(J: Array, names: tuple[str, ...], held: str, free: list[str]) -> tuple[str, ...]:
    """Return the parameters that move the tips as a held one does.

    There are none if it moves the tips by less than the noise.
    """
    own, others = J[:, names.index(held)], J[:, [names.index(name) for name in free]]
    if np.linalg.norm(own) < 1.0:
        return ()
    parts = np.abs(np.linalg.lstsq(others, own)[0]) * np.linalg.norm(others, axis=0)
    return tuple(name for name, part in zip(free, parts, strict=True) if part >= _SHARE * parts.max(initial=0.0))


def _closed(
    whiten: _Whitened,
    model: TipModel,
    free: tuple[str, ...],
    dropped: tuple[_Dropped, ...],
    singular: Array,
    good: Mask,
    before: Array,
    sd: float,
) -> _Fit:
    unit = np.array([TOLERANCE[name] for name in free])
    J, r = whiten.derivative(model, free), whiten.residuals(model)
    rows = int(whiten.finite[good].sum())
    if rows <= len(free):
        raise InputError(
            f"{whiten.measured.name}: {rows} coordinates for {len(free)} parameters leave nothing to judge the fit by; "
            "measure at least 10 poses, better 30"
        )
    inverse = np.linalg.inv(np.einsum("nik,nil->kl", J[good], J[good]))
    # A pose that was not used predicts itself; of one that was, (I - H)^-1 r takes its own share
    # out.
    hat = J @ inverse @ np.swapaxes(J, -1, -2)
    left = np.linalg.solve(np.eye(3) - hat * (1.0 - 1e-12), r[..., None])[..., 0]
    out = np.where(good[:, None], left, r)
    off = np.linalg.solve(whiten.inverse, np.stack([r, out], axis=-1))
    off = np.where(whiten.finite[..., None], off, np.nan)
    return _Fit(
        model=model,
        names=free,
        covariance=inverse * np.outer(unit, unit),
        singular=singular,
        dropped=dropped,
        residuals=off[..., 0],
        held_out=off[..., 1],
        before=before,
        used=good,
        square=float(np.square(r[good]).sum()),
        freedom=rows - len(free),
        sd=sd,
    )


def _chance(plain: _Fit, general: _Fit) -> float:
    """Return the probability of the plain fit's larger residuals, if its assumption held."""
    more = general.freedom
    extra = max(len(general.names) - len(plain.names), 1)
    scale = (plain.sd / general.sd) ** 2  # both in the general fit's standard deviations
    ratio = max(plain.square * scale - general.square, 0.0) / extra / (max(general.square, np.finfo(float).tiny) / more)
    return float(f.sf(ratio, extra, more))


def _result(
    measured: Measurements, start: TipModel, fit: _Fit, linkage: Linkage, equal_rms: float | None, chance: float | None
) -> Calibrated:
    stated = measured.tip_sd is not None
    doubt = float(chi2.sf(fit.square, fit.freedom)) if stated else 1.0
    factor = fit.factor
    widened = factor if not stated or (doubt < _DOUBT and factor > 1.0) else 1.0
    covariance = fit.covariance * (widened / fit.sd) ** 2
    notes = list(still_notes(measured))
    if measured.by_distance.any():
        notes.append(
            f"{int(measured.by_distance.sum())} poses are measured by their distance: the error of that counts for them"
        )
    cause = f"the intervals are widened by {factor:.2g}: more noise than stated, or the model lacks something"
    if (~fit.used).any():
        poses = np.flatnonzero(~fit.used)
        far = [f"{pose + 1} ({1e3 * float(np.linalg.norm(np.nan_to_num(fit.residuals[pose]))):.1f} mm)" for pose in poses]
        why = "measure them again"
        if linkage == "equal":
            why += ", or the links are not equal: --linkage auto asks the data"
        notes.append(f"left out as bad targets: pose {', '.join(far)}; {why}")
    if chance is not None and linkage == "auto" and chance > _DOUBT:
        notes.append("the data do not tell the linkage from a parallelogram; equal links are kept")
    parameters = _parameters(start, fit, covariance)
    boom = _measured_boom(measured, start.boom, fit, covariance)
    return Calibrated(
        boom=boom,
        start=start.boom,
        model=replace(fit.model, boom=boom),
        parameters=parameters,
        free=fit.names,
        covariance=read_only(covariance),
        singular_values=read_only(np.sort(fit.singular)[::-1]),
        dropped_values=read_only([value for *_, value in fit.dropped]),
        residuals=read_only(fit.residuals),
        held_out=read_only(fit.held_out),
        before=read_only(fit.before),
        used=fit.used,
        sd_factor=factor,
        widened=stated and widened > 1.0,
        stated=stated,
        equal_links_rms=equal_rms,
        equal_links_chance=chance,
        notes=tuple(notes),
        interval_notes=(cause,) if stated and widened > 1.0 else (),
    )


def _parameters(start: TipModel, fit: _Fit, covariance: Array) -> tuple[Parameter, ...]:
    sds = dict(zip(fit.names, np.sqrt(np.diag(covariance)), strict=True))
    alike = {name: others for name, others, _ in fit.dropped}
    names = [name for name in (*fit.names, *alike) if name not in BASE]
    names.sort(key=list(TOLERANCE).index)
    first, last = start.values(tuple(names)), fit.model.values(tuple(names))
    return tuple(
        Parameter(name, float(a), float(b), float(sds[name]) if name in sds else None, alike.get(name, ()))
        for name, a, b in zip(names, first, last, strict=True)
    )


def _measured_boom(measured: Measurements, boom: Boom, fit: _Fit, covariance: Array) -> Boom:
    model = fit.model
    count = int(fit.used.sum())
    kept = [k for k, name in enumerate(fit.names) if name not in (*BASE, SIDEWAYS)]
    calibration = Calibration(
        origin=Origin(Basis.MEASURED, f"boom calibrate {measured.name}: {count} poses"),
        offset=model.offset,
        scale=model.scale,
        wind_up=model.wind_up,
        parameters=tuple(fit.names[k] for k in kept),
        covariance=read_only(covariance[np.ix_(kept, kept)]),
    )
    return replace(boom, geometry=model.boom.geometry, calibration=calibration)
