"""Input shapers: a command convolved with impulses that cancel the vibration of one mode (Singer and Seering, 1990)."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model.arrays import Array, read_only, scalar
from boom_model.errors import InputError


class Shaper(StrEnum):
    """Which impulses."""

    NONE = "none"
    ZV = "zv"
    ZVD = "zvd"


@dataclass(frozen=True, eq=False)
class Impulses:
    """A shaper: amplitudes that sum to 1, at times from 0 on; the command ends later by the last of them."""

    times: Array
    """(k,) [s]"""
    amplitudes: Array
    """(k,)"""


def impulses(shaper: Shaper, frequency: float, damping: float) -> Impulses:
    """The shaper of a mode of natural `frequency` [Hz] and `damping` ratio.

    With K = exp(-zeta pi / sqrt(1 - zeta^2)) and half a damped period D: ZV is (1, K) / (1 + K) at 0, D; ZVD is
    (1, 2 K, K^2) / (1 + K)^2 at 0, D, 2 D, and bears an error in the frequency better.

    Raises:
        InputError: the frequency is not above 0, or the damping not in [0, 1).
    """
    frequency, damping = scalar("frequency", frequency), scalar("damping", damping)
    if not frequency > 0.0:
        raise InputError(f"frequency is {frequency:g} Hz; it must be above 0 Hz")
    if not 0.0 <= damping < 1.0:
        raise InputError(f"damping is {damping:g}; it must be at least 0 and below 1")
    shape = np.sqrt(1.0 - damping**2)
    K, half = np.exp(-damping * np.pi / shape), 0.5 / (frequency * shape)
    powers = {Shaper.NONE: [1.0], Shaper.ZV: [1.0, K], Shaper.ZVD: [1.0, 2.0 * K, K**2]}[shaper]
    return Impulses(read_only(half * np.arange(len(powers))), read_only(np.array(powers) / np.sum(powers)))


def residual(shaped: Impulses, frequency: float, damping: float) -> float:
    """Vibration of a mode after the last impulse, as a share of that after a single impulse of size 1.

    V = exp(-zeta w t_k) |sum_j A_j exp(zeta w t_j) exp(i w sqrt(1 - zeta^2) t_j)|
    """
    w = 2.0 * np.pi * frequency
    decay, turn = damping * w, w * np.sqrt(1.0 - damping**2)
    late = shaped.times - shaped.times[-1]
    return float(np.abs(np.sum(shaped.amplitudes * np.exp((decay + 1j * turn) * late))))
