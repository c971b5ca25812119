"""Arguments in, clean values out: every message says what was asked, got and allowed.

A wrong Python type is a TypeError; a value out of range is a SceneError.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np

from ._errors import SceneError

if TYPE_CHECKING:
    import numpy.typing as npt

Vec3 = tuple[float, float, float]
Vec3Like = Union[Sequence[float], "npt.NDArray[Any]"]
Precision = Literal["f32", "f64"]
Prune = Literal["auto", "off", "exact", "skip"]
PRUNE = ("auto", "off", "exact", "skip")

DTYPES: dict[str, type[np.floating[Any]]] = {"f32": np.float32, "f64": np.float64}


def show(value: object) -> str:
    """A short text for a value somebody passed."""
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def number(where: str, value: object) -> float:
    """A finite float, or an error that names `where`."""
    if isinstance(value, (bool, np.bool_, str, bytes)) or (isinstance(value, np.ndarray) and value.ndim != 0):
        raise TypeError(f"{where} must be a number, got {show(value)}")
    try:
        result = float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise SceneError(f"{where} must be a finite number, got {show(value)}") from None
    except (TypeError, ValueError):
        raise TypeError(f"{where} must be a number, got {show(value)}") from None
    if not math.isfinite(result):
        raise SceneError(f"{where} must be a finite number, got {result}")
    return result


def ranged(where: str, value: object, allowed: str, good: Any) -> float:
    """A finite float for which `good(value)` holds; `allowed` says so in words."""
    result = number(where, value)
    if not good(result):
        raise SceneError(f"{where} must be {allowed}, got {result:g}")
    return result


def positive(where: str, value: object) -> float:
    """A finite float above zero."""
    return ranged(where, value, "> 0", lambda v: v > 0)


def non_negative(where: str, value: object) -> float:
    """A finite float, zero or above."""
    return ranged(where, value, ">= 0", lambda v: v >= 0)


def integer(where: str, value: object, low: int, high: int) -> int:
    """An integer in [low, high]."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{where} must be an integer, got {value!r}")
    try:
        result = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{where} must be an integer, got {show(value)}") from None
    if not low <= result <= high:
        raise SceneError(f"{where} must be in [{low}, {high}], got {show(result)}")
    return result


def vec3(where: str, value: object) -> Vec3:
    """Three finite floats."""
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{where} must be three numbers, got {show(value)}")
    try:
        items = list(value)  # type: ignore[call-overload]
    except TypeError:
        raise TypeError(f"{where} must be three numbers, got {show(value)}") from None
    if len(items) != 3:
        raise SceneError(f"{where} must be three numbers, got {len(items)}: {show(value)}")
    x, y, z = (number(f"{where}[{axis}]", item) for axis, item in enumerate(items))
    return (x, y, z)


def triple(where: str, value: Any) -> Vec3:
    """A number for all three axes, or three."""
    if hasattr(value, "__len__") and not isinstance(value, (str, bytes)):
        return vec3(where, value)
    scalar = number(where, value)
    return (scalar, scalar, scalar)


def counts(where: str, value: Any) -> tuple[int, int, int]:
    """An integer >= 0 for all three axes, or three."""
    items = tuple(value) if isinstance(value, (tuple, list, np.ndarray)) else (value, value, value)
    if len(items) != 3:
        raise SceneError(f"{where} must be None, an integer or three, got {show(value)}")
    x, y, z = (integer(f"{where}[{axis}]", item, 0, 2**20) for axis, item in enumerate(items))
    return (x, y, z)


def direction(where: str, value: object) -> Vec3:
    """Three finite floats, not all zero."""
    result = vec3(where, value)
    if result == (0.0, 0.0, 0.0):
        raise SceneError(f"{where} must not be the zero vector")
    return result


def choice(where: str, value: object, allowed: Sequence[str]) -> str:
    """One of a few words."""
    if not isinstance(value, str):
        raise TypeError(f"{where} must be one of {', '.join(map(repr, allowed))}, got {show(value)}")
    if value not in allowed:
        raise SceneError(f"{where} must be one of {', '.join(map(repr, allowed))}, got {value!r}")
    return value


def array(where: str, value: object, precision: str) -> npt.NDArray[Any]:
    """A C-contiguous finite float array of the precision; integers and floats are taken."""
    dtype = DTYPES[choice("precision", precision, tuple(DTYPES))]
    try:
        raw = np.asarray(value)
    except ValueError:
        raise SceneError(f"{where} must be a rectangular array of numbers, got rows of unequal length") from None
    if raw.dtype.kind not in "fiu":
        raise TypeError(f"{where} must be an array of real numbers, got dtype {raw.dtype}")
    with np.errstate(over="ignore"):
        result = np.ascontiguousarray(raw, dtype=dtype) if raw.ndim else raw.astype(dtype)
    if not np.isfinite(result).all():
        bad = int(np.flatnonzero(~np.isfinite(result).reshape(-1))[0])
        raise SceneError(f"{where} must be finite in {precision}, got {raw.reshape(-1)[bad]} at flat index {bad}")
    return result


def points(where: str, value: object, precision: str) -> npt.NDArray[Any]:
    """A finite (N, 3) float array of the precision."""
    result = array(where, value, precision)
    if result.ndim != 2 or result.shape[1] != 3:
        raise SceneError(f"{where} must have shape (N, 3), got {result.shape}")
    return result


def boolean(where: str, value: object) -> bool:
    """True or False, nothing that merely counts as such."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{where} must be True or False, got {show(value)}")
    return bool(value)


def device(value: object) -> str:
    """A device's name; whether it exists is found out where it is used."""
    if not isinstance(value, str):
        raise TypeError(f"device must be 'auto', 'cpu', 'gpu' or 'gpu:N', got {show(value)}")
    return value
