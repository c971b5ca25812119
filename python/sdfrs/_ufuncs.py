"""Which numpy functions a formula knows, and the op each one becomes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ._expr import Expr, Point, as_expr, binary, op, power
from .formula import clamp, length, where

_UNARY = {
    "negative": "neg", "absolute": "abs", "fabs": "abs", "sqrt": "sqrt", "square": "square", "floor": "floor",
    "sin": "sin", "cos": "cos", "tan": "tan", "exp": "exp", "log": "log", "arcsin": "asin", "arccos": "acos",
    "arctan": "atan", "sign": "sign",
}  # fmt: skip
_BINARY = {
    "add": "add", "subtract": "sub", "multiply": "mul", "divide": "div", "minimum": "min", "maximum": "max",
    "fmin": "min", "fmax": "max", "remainder": "mod", "arctan2": "atan2",
}  # fmt: skip
UNSUPPORTED = (
    "a formula cannot become a numpy array; numpy functions it knows: "
    + ", ".join(sorted([*_UNARY, *_BINARY, "power", "hypot", "clip", "positive", "reciprocal"]))
    + ", linalg.norm, dot, where"
)


def _map(function: Callable[[Expr], Expr], value: Any) -> Any:
    return Point(*(function(v) for v in value)) if isinstance(value, Point) else function(as_expr(value))


def apply(ufunc: Any, method: str, inputs: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    name = str(ufunc.__name__)
    if method != "__call__" or kwargs:
        raise TypeError(f"np.{name} in a formula is called plainly, without out=, where= or .{method}")
    if name in _UNARY:
        return _map(lambda v: op(_UNARY[name], v), inputs[0])
    if name in _BINARY:
        return binary(_BINARY[name], *inputs)
    if name in ("less", "less_equal", "greater", "greater_equal"):
        a, b = (as_expr(v) for v in inputs)
        return {"less": a < b, "less_equal": a <= b, "greater": a > b, "greater_equal": a >= b}[name]
    special: dict[str, Callable[..., Any]] = {
        "power": power,
        "float_power": power,
        "hypot": lambda a, b: length(a, b),
        "positive": lambda a: a,
        "reciprocal": lambda a: _map(lambda v: binary("div", 1.0, v), a),
        "clip": clamp,
        "floor_divide": lambda a, b: _map(lambda v: op("floor", v), binary("div", a, b)),
    }
    if name in special:
        return special[name](*inputs)
    raise TypeError(f"np.{name} has no place in a formula; {UNSUPPORTED}")


def apply_function(func: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    if not kwargs:
        if func is np.linalg.norm and len(args) == 1:
            return length(args[0])
        if func is np.dot and len(args) == 2:
            u, v = (Point(*a) for a in args)
            return u.x * v.x + u.y * v.y + u.z * v.z
        if func is np.where and len(args) == 3:
            return where(*args)
        if func is np.clip and len(args) == 3:
            return clamp(*args)
    raise TypeError(f"np.{func.__name__} has no place in a formula; {UNSUPPORTED}")
