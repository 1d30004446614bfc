"""Checks of arrays at the public boundary, and read-only arrays for frozen data."""

from math import isfinite
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boom_model.errors import InputError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SMALL = 1000
"""Size of an array up to which one sum is quicker than a look at every entry."""


def read_only(values: ArrayLike, order: Literal["K", "F"] = "K") -> Array:
    """Return a float64 copy that cannot be written to.

    In memory it is ordered as `values`, or column by column with "F".
    """
    array = np.array(values, dtype=float, order=order)
    array.flags.writeable = False
    return array


def checked(name: str, values: ArrayLike, last: int | None = None) -> Array:
    """Return `values` as a float64 array of shape (..., last) with finite entries.

    Args:
        name: name of the array in messages.
        values: numbers.
        last: required length of the last axis; None accepts any shape.

    Raises:
        InputError: `values` are not numbers, have the wrong last axis, or contain NaN or infinity;
            the message names the first offending index.
    """
    try:
        array: Array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InputError(f"{name} is not an array of numbers: {error}") from None
    if last is not None and (array.ndim == 0 or array.shape[-1] != last):
        raise InputError(f"{name} has shape {array.shape}; its last axis must have length {last}")
    # A sum of squares is finite where all is, short of overflow: the one quick look at a small
    # array. BLAS would take a large one on several threads, which wait for their turn on a busy
    # machine.
    if not (array.size <= _SMALL and isfinite(np.vdot(array, array))) and not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise InputError(f"{where} is {array[index]}; it must be a finite number")
    return array


def scalar(name: str, value: ArrayLike) -> float:
    """Return `value` as one finite number.

    Raises:
        InputError: `value` is not a number, not finite, or more than one number.
    """
    array = checked(name, value)
    if array.shape != ():
        raise InputError(f"{name} has shape {array.shape}; it must be one number")
    return float(array)


def broadcast(**named: ArrayLike) -> tuple[Array, ...]:
    """Return the named joint arrays, each checked as (..., 5), broadcast to one shape.

    Raises:
        InputError: as `checked`, or the shapes do not broadcast.
    """
    arrays = [checked(name, values, 5) for name, values in named.items()]
    if len({array.shape for array in arrays}) == 1:
        return tuple(arrays)
    try:
        return tuple(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(named, arrays, strict=True))
        raise InputError(f"shapes do not match: {shapes}") from None
