"""Input shapers: a command is convolved with impulses that cancel the vibration of one mode.

Source: Singer and Seering, 1990.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from boom_model.arrays import Array, read_only, scalar
from boom_model.errors import InputError


class Shaper(StrEnum):
    """Kind of input shaper."""

    NONE = "none"
    ZV = "zv"
    ZVD = "zvd"


@dataclass(frozen=True, eq=False)
class Impulses:
    """Impulses of an input shaper. The first is at time 0 and the amplitudes sum to 1.

    The command ends later by the time of the last impulse.
    """

    times: Array
    """(k,) times [s]."""
    amplitudes: Array
    """(k,) amplitudes."""


def impulses(shaper: Shaper, frequency: float, damping: float) -> Impulses:
    """Compute the impulses of a shaper for one mode.

    With K = exp(-zeta pi / sqrt(1 - zeta^2)) and D half a damped period:

        ZV    (1, K) / (1 + K) at 0, D
        ZVD   (1, 2 K, K^2) / (1 + K)^2 at 0, D, 2 D

    ZVD is less sensitive to an error in the frequency.

    Args:
        shaper: kind of shaper.
        frequency: natural frequency of the mode [Hz].
        damping: damping ratio zeta of the mode.

    Raises:
        InputError: the frequency is not above 0, or the damping is not in [0, 1).
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
    """Compute the vibration of a mode after the last impulse, relative to a single unit impulse.

    V = exp(-zeta w t_k) |sum_j A_j exp(zeta w t_j) exp(i w sqrt(1 - zeta^2) t_j)|
    """
    w = 2.0 * np.pi * frequency
    decay, turn = damping * w, w * np.sqrt(1.0 - damping**2)
    late = shaped.times - shaped.times[-1]
    return float(np.abs(np.sum(shaped.amplitudes * np.exp((decay + 1j * turn) * late))))
