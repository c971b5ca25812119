"""What formulas are made of: expressions, points and comparisons.

Operators and numpy ufuncs on them build a graph; nothing is evaluated yet.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable, Iterator
from typing import Any, Optional, Union

import numpy as np

from . import _core
from ._check import number, show
from ._errors import SceneError

ExprLike = Union["Expr", float]


class Expr:
    """A number that depends on the point: what formulas are made of.

    Made from ``p.x``, ``p.y``, ``p.z`` by operators and numpy ufuncs; comparisons
    stand inside `sdfrs.where` only.

    Examples:
        >>> import numpy as np, sdfrs
        >>> @sdfrs.shape(lipschitz=1.0)
        ... def slab(p):
        ...     height = np.abs(p.y)          # an Expr
        ...     return height - 0.5
        >>> float(slab([[0, 2, 0]])[0])
        1.5
    """

    __slots__ = ("_node",)
    _node: _core.Node

    def __init__(self) -> None:
        raise TypeError("Expr is made by a formula's point: p.x, p.y, p.z (see sdfrs.shape)")

    @classmethod
    def _wrap(cls, node: _core.Node) -> Expr:
        result = object.__new__(cls)
        result._node = node
        return result

    def __repr__(self) -> str:
        return f"<sdfrs.Expr {self._node.op}>"

    def __add__(self, other: ExprLike) -> Expr:
        return binary("add", self, other)

    def __radd__(self, other: ExprLike) -> Expr:
        return binary("add", other, self)

    def __sub__(self, other: ExprLike) -> Expr:
        return binary("sub", self, other)

    def __rsub__(self, other: ExprLike) -> Expr:
        return binary("sub", other, self)

    def __mul__(self, other: ExprLike) -> Expr:
        return binary("mul", self, other)

    def __rmul__(self, other: ExprLike) -> Expr:
        return binary("mul", other, self)

    def __truediv__(self, other: ExprLike) -> Expr:
        return binary("div", self, other)

    def __rtruediv__(self, other: ExprLike) -> Expr:
        return binary("div", other, self)

    def __mod__(self, other: ExprLike) -> Expr:
        return binary("mod", self, other)

    def __rmod__(self, other: ExprLike) -> Expr:
        return binary("mod", other, self)

    def __floordiv__(self, other: ExprLike) -> Expr:
        return op("floor", binary("div", self, other))

    def __rfloordiv__(self, other: ExprLike) -> Expr:
        return op("floor", binary("div", other, self))

    def __pow__(self, other: float) -> Expr:
        return power(self, other)

    def __rpow__(self, other: object) -> Expr:
        raise SceneError("power: the exponent must be an integer or 0.5, got an expression; use np.exp and np.log")

    def __neg__(self) -> Expr:
        return op("neg", self)

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        return op("abs", self)

    def __lt__(self, other: ExprLike) -> Condition:
        return Condition._less(self, other, swap=False)

    def __gt__(self, other: ExprLike) -> Condition:
        return Condition._less(other, self, swap=False)

    def __le__(self, other: ExprLike) -> Condition:
        return Condition._less(other, self, swap=True)

    def __ge__(self, other: ExprLike) -> Condition:
        return Condition._less(self, other, swap=True)

    def __eq__(self, other: object) -> bool:
        raise SceneError("a formula compares with < <= > >= inside sdfrs.where; == has no place in a field")

    __ne__ = __eq__
    __hash__ = object.__hash__

    def __bool__(self) -> bool:
        raise SceneError("a formula is traced once, so `if`, `and`, `or` cannot look at a value: use sdfrs.where")

    def __float__(self) -> float:
        raise TypeError("an expression has no value of its own: use numpy functions, not math.*, in a formula")

    def __iter__(self) -> Iterator[Any]:
        raise TypeError("an expression is one number, not a sequence")

    def clip(self, min: Optional[ExprLike] = None, max: Optional[ExprLike] = None, **_: object) -> Expr:
        """What ``np.clip`` calls: the value held between two others."""
        low = self if min is None else binary("max", self, min)
        return low if max is None else binary("min", low, max)

    def __array__(self, *_: object, **__: object) -> Any:
        from . import _ufuncs

        raise TypeError(_ufuncs.UNSUPPORTED)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        from . import _ufuncs

        return _ufuncs.apply(ufunc, method, inputs, kwargs)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        from . import _ufuncs

        return _ufuncs.apply_function(func, args, kwargs)


class Point:
    """The point a formula is asked about: ``p.x``, ``p.y``, ``p.z`` and vector arithmetic.

    ``+ - * /`` take numbers, triples and points; numpy ufuncs work component by component.

    Examples:
        >>> import numpy as np, sdfrs
        >>> @sdfrs.shape(lipschitz=1.0)
        ... def cube(p):
        ...     q = np.abs(p) - (0.5, 0.5, 0.5)      # a Point
        ...     return sdfrs.max(q.x, q.y, q.z)
        >>> float(cube([[2, 0, 0]])[0])
        1.5
    """

    __slots__ = ("x", "y", "z")
    x: Expr
    y: Expr
    z: Expr

    def __init__(self, x: ExprLike, y: ExprLike, z: ExprLike) -> None:
        for name, value in (("x", x), ("y", y), ("z", z)):
            object.__setattr__(self, name, as_expr(value))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a point does not change: make a new one, sdfrs.Point(x, y, z)")

    def __repr__(self) -> str:
        return f"<sdfrs.Point {self.x!r} {self.y!r} {self.z!r}>"

    def __iter__(self) -> Iterator[Expr]:
        return iter((self.x, self.y, self.z))

    def __len__(self) -> int:
        return 3

    def __getitem__(self, index: int) -> Expr:
        return (self.x, self.y, self.z)[index]

    def __add__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("add", a, b), self, other)

    def __radd__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("add", a, b), other, self)

    def __sub__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("sub", a, b), self, other)

    def __rsub__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("sub", a, b), other, self)

    def __mul__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("mul", a, b), self, other)

    def __rmul__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("mul", a, b), other, self)

    def __truediv__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("div", a, b), self, other)

    def __rtruediv__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("div", a, b), other, self)

    def __mod__(self, other: Any) -> Point:
        return zip_points(lambda a, b: binary("mod", a, b), self, other)

    def __pow__(self, other: float) -> Point:
        return Point(*(power(v, other) for v in self))

    def __neg__(self) -> Point:
        return Point(*(op("neg", v) for v in self))

    def __abs__(self) -> Point:
        return Point(*(op("abs", v) for v in self))

    def __array__(self, *_: object, **__: object) -> Any:
        from . import _ufuncs

        raise TypeError(_ufuncs.UNSUPPORTED)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        from . import _ufuncs

        return _ufuncs.apply(ufunc, method, inputs, kwargs)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        from . import _ufuncs

        return _ufuncs.apply_function(func, args, kwargs)


class Condition:
    """``a < b`` inside a formula; only `sdfrs.where` can use it.

    Examples:
        >>> import sdfrs
        >>> @sdfrs.shape(lipschitz=1.0)
        ... def half(p):
        ...     return sdfrs.where(p.x < 0, -p.x, p.x)
        >>> float(half([[-3, 0, 0]])[0])
        3.0
    """

    __slots__ = ("_a", "_b", "_swap")
    _a: Expr
    _b: Expr
    _swap: bool

    @classmethod
    def _less(cls, a: Any, b: Any, *, swap: bool) -> Condition:
        result = object.__new__(cls)
        # a < b picks the first branch, unless swapped: a <= b is not (b < a)
        result._a, result._b, result._swap = as_expr(a), as_expr(b), swap
        return result

    def __init__(self) -> None:
        raise TypeError("a condition is made by comparing expressions in a formula")

    def __bool__(self) -> bool:
        raise SceneError("a formula is traced once, so `if`, `and`, `or` cannot look at a value: use sdfrs.where")


def op(name: str, *children: Expr) -> Expr:
    return Expr._wrap(_core.Node.build(name, [], [child._node for child in children]))


def as_expr(value: Any) -> Expr:
    if isinstance(value, Expr):
        return value
    if isinstance(value, Point):
        raise SceneError("a number or an expression is needed here, got a point: take p.x, p.y, p.z or sdfrs.length(p)")
    if isinstance(value, Condition):
        raise SceneError("a number or an expression is needed here, got a comparison: use sdfrs.where")
    return Expr._wrap(_core.Node.build("const", [("value", number("a formula's constant", value))], []))


def binary(name: str, a: Any, b: Any) -> Any:
    if isinstance(a, Point) or isinstance(b, Point):
        return zip_points(lambda u, v: binary(name, u, v), a, b)
    return op(name, as_expr(a), as_expr(b))


def _triple(value: Any) -> tuple[Any, Any, Any]:
    if isinstance(value, (tuple, list, np.ndarray, Point)) and not (isinstance(value, np.ndarray) and value.ndim == 0):
        if len(value) != 3:
            raise SceneError(f"a point takes a number or three, got {len(value)}: {show(value)}")
        return value[0], value[1], value[2]
    return value, value, value


def zip_points(function: Callable[[Any, Any], Expr], a: Any, b: Any) -> Point:
    return Point(*(function(u, v) for u, v in zip(_triple(a), _triple(b))))


def power(base: Any, exponent: Any) -> Any:
    if isinstance(base, Point):
        return Point(*(power(v, exponent) for v in base))
    if isinstance(exponent, (Expr, Point)):
        raise SceneError("power: the exponent must be an integer or 0.5, got an expression; use np.exp and np.log")
    value = number("power: the exponent", exponent)
    base = as_expr(base)
    if value == 0.5:
        return op("sqrt", base)
    if value != int(value) or builtins.abs(value) > 64:
        raise SceneError(f"power: the exponent must be 0.5 or an integer in [-64, 64], got {value:g}")
    count = builtins.abs(int(value))
    result: Optional[Expr] = None
    while count:  # by squaring: x**8 is three squares
        if count & 1:
            result = base if result is None else op("mul", result, base)
        count >>= 1
        base = op("square", base) if count else base
    result = as_expr(1.0) if result is None else result
    return binary("div", 1.0, result) if value < 0 else result
