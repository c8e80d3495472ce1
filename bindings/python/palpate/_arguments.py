"""Checks of arguments that Python code takes; the extension module has its own."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate._errors import InputError

if TYPE_CHECKING:
    from palpate._poses import Array


def numbers(given: Any, name: str, shape: tuple[int, ...]) -> Array:
    """New array of finite numbers of a shape."""
    try:
        array = np.array(given)
        if array.dtype.kind == "c":
            raise TypeError("they are complex")
        array = array.astype(float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} is no array of numbers ({error}), expected numbers of shape {shape}") from None
    if array.shape != shape:
        raise InputError(f"{name} has the shape {array.shape}, expected {shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} has numbers that are not finite: {array.tolist()}")
    return array


def flags(given: Any, name: str, count: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """New array of truth values."""
    try:
        array = np.array(given)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is no array of truth values ({error}), expected shape ({count},)") from None
    if array.shape != (count,) or array.dtype.kind not in "bui":
        raise InputError(f"{name} holds {array.dtype} in the shape {array.shape}, expected bool of shape ({count},)")
    return array.astype(bool)


def whole(given: Any, name: str) -> int:
    """Whole number from 1."""
    try:
        number = operator.index(given)
    except TypeError:
        number = 0
    if number < 1:
        raise InputError(f"{name} is {given!r}, expected a whole number, 1 or more")
    return number


def positive(given: Any, name: str, unit: str = "") -> float:
    """Finite number above zero."""
    try:
        number = float(given)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not 0 < number < math.inf:
        raise InputError(f"{name} is {given!r}, expected a number{unit} above 0")
    return number
