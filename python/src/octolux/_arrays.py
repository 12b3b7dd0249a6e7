"""Arrays and numbers of a caller: what fits is taken as it lies, what does not gets a sentence."""

import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def array(name: str, value: object, columns: int | None, dtype: type = np.float32) -> NDArray[Any]:
    """Give `value` as a C-contiguous array of shape `(n, columns)`, or `(n,)`; no copy where it is one already."""
    wanted = "(n,)" if columns is None else f"(n, {columns})"
    try:
        found = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{name} is no array: its rows differ in length; it must have the shape {wanted}") from error
    kinds = "iu" if np.issubdtype(dtype, np.integer) else "fiu"
    if found.dtype.kind not in kinds and found.size > 0:
        numbers = "whole numbers" if kinds == "iu" else "real numbers"
        raise TypeError(f"{name} must hold {numbers}, and its type is {found.dtype}")
    if found.size == 0 and found.ndim == 1 and columns is not None:
        found = found.reshape(0, columns)
    fits = found.ndim == 1 if columns is None else found.ndim == 2 and found.shape[1] == columns
    if not fits:
        raise ValueError(f"{name} must have the shape {wanted}, and has {found.shape}")
    if dtype is np.uint32 and found.size > 0 and (int(found.min()) < 0 or int(found.max()) > 0xFFFFFFFF):
        raise ValueError(f"{name} must hold numbers from 0 to 4294967295, and holds {found.min()} to {found.max()}")
    with np.errstate(over="ignore"):
        return np.require(found, dtype=dtype, requirements=["C", "A"])


def vectors(name: str, value: ArrayLike, count: int | None = None) -> NDArray[np.float32]:
    """Give rays' `(n, 3)`; one vector `(3,)` stands for all `count`."""
    if count is not None and np.shape(value) == (3,):
        return np.ascontiguousarray(np.broadcast_to(array(name, [value], 3), (count, 3)))
    return array(name, value, 3)


def numbers(name: str, value: object, count: int) -> tuple[float, ...]:
    """Give `count` real numbers as a tuple; whether they are finite is the library's affair."""
    try:
        found = np.asarray(value)
        if found.dtype.kind not in "fiu":
            raise TypeError
    except (ValueError, TypeError) as error:
        raise TypeError(f"{name} must be {count} real numbers, and is {_short(value)}") from error
    if found.shape != (count,):
        raise ValueError(f"{name} must be {count} numbers, and has the shape {found.shape}")
    return tuple(float(x) for x in found)


def number(name: str, value: object, least: float = -math.inf, most: float = math.inf) -> float:
    """Give one real number in a range."""
    if isinstance(value, (bool, str, bytes)):
        raise TypeError(f"{name} must be a number, and is {_short(value)}")
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise TypeError(f"{name} must be a number, and is {_short(value)}") from error
    if not least <= found <= most:
        bounds = f"from {least:g} on" if most == math.inf else f"from {least:g} to {most:g}"
        raise ValueError(f"{name} goes {bounds}, and is {found:g}")
    return found


def real(name: str, value: object) -> float:
    """Give one real number, whatever it is: the library has its rules."""
    if isinstance(value, (bool, str, bytes)):
        raise TypeError(f"{name} must be a number, and is {_short(value)}")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise TypeError(f"{name} must be a number, and is {_short(value)}") from error


def whole(name: str, value: object, least: int, most: int) -> int:
    """Give a whole number in a range."""
    try:
        if isinstance(value, bool):
            raise TypeError
        found = operator.index(value)  # type: ignore[arg-type]
    except TypeError as error:
        raise TypeError(f"{name} must be a whole number, and is {_short(value)}") from error
    if not least <= found <= most:
        raise ValueError(f"{name} goes from {least} to {most}, and is {_short(found)}")
    return found


def size(value: object) -> tuple[int, int]:
    """Give width and height in pixels."""
    if not isinstance(value, (tuple, list, np.ndarray)) or len(value) != 2:
        raise TypeError(f"size must be (width, height), and is {_short(value)}")
    return whole("width", value[0], 1, 65536), whole("height", value[1], 1, 65536)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
