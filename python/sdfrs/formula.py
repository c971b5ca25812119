"""Formulas: a Python function of a point becomes a graph that every evaluator runs.

The function is called once, with a `Point` whose coordinates are expressions.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Optional, overload

import numpy as np

from . import _core
from ._check import positive, show, vec3
from ._errors import SceneError
from ._expr import Condition, Expr, Point, as_expr, binary, op, zip_points

if TYPE_CHECKING:
    from ._check import Vec3Like
    from .shapes import Shape


def _symbolic(values: tuple[Any, ...]) -> bool:
    return any(isinstance(value, (Expr, Point)) for value in values)


def length(*values: Any) -> Expr:
    """Euclidean length of a point, or of two or three expressions.

    Args: a `Point`, or 2 or 3 expressions or numbers. Returns an `Expr`, world units.
    Raises: SceneError for any other count.

    Examples:
        >>> import sdfrs
        >>> ball = sdfrs.shape(lambda p: sdfrs.length(p) - 1.0)
        >>> float(ball([[3, 0, 0]])[0])
        2.0
    """
    items = tuple(values[0]) if len(values) == 1 and isinstance(values[0], (Point, tuple, list)) else values
    if len(items) not in (2, 3):
        raise SceneError(f"length takes a point, or 2 or 3 expressions, got {len(items)}")
    return op("length", *(as_expr(item) for item in items))


def _fold(name: str, plain: Callable[..., Any], values: tuple[Any, ...]) -> Any:
    items = tuple(values[0]) if len(values) == 1 and isinstance(values[0], Point) else values
    if not _symbolic(items):
        return plain(*values)  # so that `from sdfrs import *` leaves min and max as they were
    result = items[0]
    for item in items[1:]:
        result = binary(name, result, item)
    return result


def min(*values: Any) -> Any:
    """Smallest of several expressions (of a point's coordinates, given one point).

    Args: expressions, points or numbers; without any expression it is Python's own `min`.

    Examples:
        >>> import sdfrs
        >>> two = sdfrs.shape(lambda p: sdfrs.min(sdfrs.length(p) - 1.0, p.y + 1.0))
        >>> float(two([[0, 3, 0]])[0])
        2.0
    """
    return _fold("min", builtins.min, values)


def max(*values: Any) -> Any:
    """Largest of several expressions (of a point's coordinates, given one point).

    Args: expressions, points or numbers; without any expression it is Python's own `max`.

    Examples:
        >>> import sdfrs
        >>> cut = sdfrs.shape(lambda p: sdfrs.max(sdfrs.length(p) - 1.0, p.y))
        >>> float(cut([[0, 3, 0]])[0])
        3.0
    """
    return _fold("max", builtins.max, values)


def mix(a: Any, b: Any, t: Any) -> Any:
    """``a + (b - a)*t``: `a` where t is 0, `b` where t is 1.

    Args: expressions, points or numbers.

    Examples:
        >>> import sdfrs
        >>> tilted = sdfrs.shape(lambda p: sdfrs.mix(p.y, p.x, 0.5))
        >>> float(tilted([[2, 0, 0]])[0])
        1.0
    """
    return a + (b - a) * t


def clamp(value: Any, low: Any, high: Any) -> Any:
    """`value` held between `low` and `high`: ``min(max(value, low), high)``.

    Args: expressions, points or numbers.

    Examples:
        >>> import sdfrs
        >>> rod = sdfrs.shape(lambda p: sdfrs.length(p.x - sdfrs.clamp(p.x, -1, 1), p.y, p.z) - 0.1)
        >>> round(float(rod([[3, 0, 0]])[0]), 6)
        1.9
    """
    return min(max(value, low), high)


def where(condition: Condition, a: Any, b: Any) -> Any:
    """`a` where the comparison holds, else `b`.

    Args: a comparison of expressions (``p.x < 1``); expressions, points or numbers.
    Raises: SceneError when the condition is not a comparison of expressions.

    Examples:
        >>> import sdfrs
        >>> fold = sdfrs.shape(lipschitz=1.0)(lambda p: sdfrs.where(p.y < 0, p.y * 0.5, p.y))
        >>> float(fold([[0, -4, 0]])[0])
        -2.0
    """
    if not isinstance(condition, Condition):
        raise SceneError(f"where: the condition must compare expressions, like p.x < 1, got {show(condition)}")
    if isinstance(a, Point) or isinstance(b, Point):
        return zip_points(lambda u, v: where(condition, u, v), a, b)
    first, second = (b, a) if condition._swap else (a, b)
    return op("select", condition._a, condition._b, as_expr(first), as_expr(second))


def trace_formula(function: Callable[[Point], Any], what: str) -> Expr:
    """Calls the function once on symbolic coordinates and returns what it built."""
    name = getattr(function, "__name__", type(function).__name__)
    point = Point(*(op(axis) for axis in "xyz"))
    try:
        result = function(point)
    except Exception as error:
        raise SceneError(f"{what} {name!r} raised {type(error).__name__}: {error}") from error
    if isinstance(result, (bool, int, float, np.number)):
        raise SceneError(f"{what} {name!r} returned the constant {result!r}; it must depend on the point")
    if not isinstance(result, Expr):
        raise SceneError(
            f"{what} {name!r} must return an expression of p.x, p.y, p.z, got {type(result).__name__}: {show(result)}"
        )
    if not result._node.depends_on_point:
        raise SceneError(f"{what} {name!r} returned a constant; it must depend on the point")
    return result


@overload
def shape(function: Callable[[Point], Any], /) -> Shape: ...
@overload
def shape(
    *, lipschitz: Optional[float] = None, bounds: Optional[tuple[Vec3Like, Vec3Like]] = None
) -> Callable[[Callable[[Point], Any]], Shape]: ...
def shape(
    function: Optional[Callable[[Point], Any]] = None,
    /,
    *,
    lipschitz: Optional[float] = None,
    bounds: Optional[tuple[Vec3Like, Vec3Like]] = None,
) -> Any:
    """Turns a function of a point into a `Shape`; a decorator, with or without arguments.

    Args: `lipschitz`, the bound |f(a) - f(b)| <= lipschitz*|a - b| you vouch for (None: derived from
    the formula, where its slope is bounded); `bounds`, a box (lo, hi) that the surface does not leave, world units.
    Raises: SceneError when the function raises, returns a constant or something else than an expression, or
    when no bound is given and none follows.

    Examples:
        >>> import numpy as np, sdfrs
        >>> @sdfrs.shape(lipschitz=1.6)
        ... def ripple(p):
        ...     return sdfrs.length(p) - 1.0 + 0.05 * np.sin(12.0 * p.x)
        >>> ripple.lipschitz
        1.6
        >>> ripple([[2.0, 0, 0]]).round(3)
        array([0.955], dtype=float32)
    """
    from .shapes import Shape

    bound = None if lipschitz is None else positive("shape: lipschitz", lipschitz)
    lo, hi = (None, None) if bounds is None else box_bounds("shape: bounds", bounds)

    def make(inner: Callable[[Point], Any]) -> Shape:
        if not callable(inner):
            raise TypeError(f"shape takes a function of a point, got {show(inner)}")
        expr = trace_formula(inner, "formula")
        args: list[tuple[str, Any]] = [("lipschitz", bound), ("lo", lo), ("hi", hi)]
        return Shape._wrap(_core.Node.build("formula", args, [expr._node]))

    return make if function is None else make(function)


def box_bounds(where_: str, bounds: Any) -> tuple[Any, Any]:
    """Two corners, each lo < hi."""
    try:
        lo, hi = bounds
    except (TypeError, ValueError):
        raise SceneError(f"{where_} must be a pair (lo, hi) of corners, got {show(bounds)}") from None
    low, high = vec3(f"{where_}: lo", lo), vec3(f"{where_}: hi", hi)
    if not all(a < b for a, b in zip(low, high)):
        raise SceneError(f"{where_} must have lo < hi on every axis, got {low} and {high}")
    return low, high
