"""The primitives, named as in fogleman/sdf where it has them, and the n-ary booleans.

Each is an exact distance unless its docstring says otherwise. `center` moves it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Union

from . import _check
from ._errors import SceneError
from .shapes import Shape, build

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._check import Vec3Like

_ORIGIN = (0.0, 0.0, 0.0)


def _centred(op: str, args: list[tuple[str, Any]], center: Vec3Like) -> Shape:
    made = build(op, args, [])
    offset = _check.vec3(f"{op}: center", center)
    return made if offset == _ORIGIN else made.translate(offset)


def _sizes(where: str, value: Any) -> tuple[float, float, float]:
    result = _check.triple(where, value)
    if min(result) <= 0:
        raise SceneError(f"{where} must be > 0 on every axis, got {_check.show(value)}")
    return result


def sphere(radius: float = 1.0, *, center: Vec3Like = _ORIGIN) -> Shape:
    """A ball of `radius` > 0 world units.

    Raises: SceneError for a radius of 0 or less.

    Examples:
        >>> import sdfrs
        >>> sdfrs.sphere(1.0, center=(2, 0, 0))([[0, 0, 0]])
        array([1.], dtype=float32)
    """
    return _centred("sphere", [("radius", _check.positive("sphere: radius", radius))], center)


def box(size: Union[float, Vec3Like] = 1.0, *, center: Vec3Like = _ORIGIN) -> Shape:
    """A box of full edge lengths `size` > 0: a number is a cube, or three.

    Examples:
        >>> import sdfrs
        >>> sdfrs.box((2, 4, 2)).bounds[1]
        (1.0, 2.0, 1.0)
    """
    return _centred("box", [("size", _sizes("box: size", size))], center)


def rounded_box(size: Union[float, Vec3Like], radius: float, *, center: Vec3Like = _ORIGIN) -> Shape:
    """A box of full edge lengths `size`, its edges rounded by `radius` (at most half the shortest edge).

    Examples:
        >>> import sdfrs
        >>> round(float(sdfrs.rounded_box((2, 2, 2), 0.2)([[2, 0, 0]])[0]), 6)
        1.0
    """
    args = [
        ("size", _sizes("rounded_box: size", size)),
        ("radius", _check.non_negative("rounded_box: radius", radius)),
    ]
    return _centred("rounded_box", args, center)


def torus(major: float, minor: float, *, center: Vec3Like = _ORIGIN) -> Shape:
    """A ring about the y axis: `major` from the axis to the tube's middle, `minor` the tube's radius.

    Examples:
        >>> import sdfrs
        >>> round(float(sdfrs.torus(1.0, 0.25)([[2, 0, 0]])[0]), 6)
        0.75
    """
    args = [("major", _check.positive("torus: major", major)), ("minor", _check.positive("torus: minor", minor))]
    return _centred("torus", args, center)


def cylinder(radius: float, height: float = 1.0, *, center: Vec3Like = _ORIGIN) -> Shape:
    """A closed cylinder along y, of full `height`.

    Examples:
        >>> import sdfrs
        >>> sdfrs.cylinder(0.5, height=4).bounds
        ((-0.5, -2.0, -0.5), (0.5, 2.0, 0.5))
    """
    args = [
        ("radius", _check.positive("cylinder: radius", radius)),
        ("height", _check.positive("cylinder: height", height)),
    ]
    return _centred("cylinder", args, center)


def capsule(a: Vec3Like, b: Vec3Like, radius: float) -> Shape:
    """All points within `radius` of the segment from `a` to `b`.

    Examples:
        >>> import sdfrs
        >>> float(sdfrs.capsule((0, 0, 0), (0, 2, 0), 0.5)([[0, 4, 0]])[0])
        1.5
    """
    args = [
        ("a", _check.vec3("capsule: a", a)),
        ("b", _check.vec3("capsule: b", b)),
        ("radius", _check.positive("capsule: radius", radius)),
    ]
    return build("capsule", args, [])


def cone(radius: float, height: float, *, top_radius: float = 0.0, center: Vec3Like = _ORIGIN) -> Shape:
    """A cone along y of full `height`: `radius` below, `top_radius` >= 0 above.

    Examples:
        >>> import sdfrs
        >>> round(float(sdfrs.cone(1.0, 2.0)([[0, 3, 0]])[0]), 6)
        2.0
    """
    args = [
        ("radius", _check.non_negative("cone: radius", radius)),
        ("height", _check.positive("cone: height", height)),
        ("top_radius", _check.non_negative("cone: top_radius", top_radius)),
    ]
    return _centred("cone", args, center)


def ellipsoid(radii: Vec3Like, *, center: Vec3Like = _ORIGIN) -> Shape:
    """An ellipsoid of three radii > 0; a lower bound of the distance.

    Examples:
        >>> import sdfrs
        >>> bool(sdfrs.ellipsoid((1, .5, .2))([[0, 0.6, 0]])[0] > 0)
        True
    """
    return _centred("ellipsoid", [("radii", _sizes("ellipsoid: radii", radii))], center)


def plane(normal: Vec3Like = (0, 1, 0), point: Vec3Like = _ORIGIN) -> Shape:
    """The half-space behind the plane through `point`; `normal` points out, any length but zero.

    Examples:
        >>> import sdfrs
        >>> sdfrs.plane()([[0, 3, 0]])
        array([3.], dtype=float32)
    """
    args = [("normal", _check.direction("plane: normal", normal)), ("point", _check.vec3("plane: point", point))]
    return build("plane", args, [])


def gyroid(period: float, thickness: float) -> Shape:
    """A gyroid sheet without end: `period` > 0 and `thickness` > 0, world units; a lower bound of the distance.

    Examples:
        >>> import sdfrs
        >>> ball = sdfrs.gyroid(0.5, 0.05) & sdfrs.sphere(1)
        >>> ball.bounds[1]
        (1.0, 1.0, 1.0)
    """
    args = [
        ("period", _check.positive("gyroid: period", period)),
        ("thickness", _check.positive("gyroid: thickness", thickness)),
    ]
    return build("gyroid", args, [])


def mandelbulb(power: int = 8, iterations: int = 8) -> Shape:
    """The Mandelbulb by its distance estimate: `power` 3 to 16, `iterations` 1 to 64.

    Source: Inigo Quilez, "Mandelbulb", 2009. An estimate, not a certified bound.

    Examples:
        >>> import sdfrs
        >>> bool(sdfrs.mandelbulb()([[2, 0, 0]])[0] > 0)
        True
    """
    args = [
        ("power", _check.integer("mandelbulb: power", power, 3, 16)),
        ("iterations", _check.integer("mandelbulb: iterations", iterations, 1, 64)),
    ]
    return build("mandelbulb", args, [])


def _gather(op: str, shapes: tuple[Any, ...]) -> list[Any]:
    items = list(shapes[0]) if len(shapes) == 1 and isinstance(shapes[0], (list, tuple)) else list(shapes)
    if not items:
        raise SceneError(f"{op}: needs at least one shape, got none")
    return items


def union(*shapes: Union[Shape, Sequence[Shape]], k: float = 0.0) -> Shape:
    """Any of the shapes (or of one list of them); `k` >= 0 is the radius of the blend, world units.

    Examples:
        >>> import sdfrs
        >>> row = sdfrs.union(*(sdfrs.sphere(1, center=(3 * i, 0, 0)) for i in range(100)))
        >>> row([[300, 0, 0]])
        array([2.], dtype=float32)
    """
    return build("union", [("k", _check.non_negative("union: k", k))], _gather("union", shapes))


def intersection(*shapes: Union[Shape, Sequence[Shape]], k: float = 0.0) -> Shape:
    """What all the shapes (or one list of them) share; `k` >= 0 rounds the edges, world units.

    Examples:
        >>> import sdfrs
        >>> roof = sdfrs.intersection(sdfrs.plane((1, 1, 0)), sdfrs.plane((-1, 1, 0)), sdfrs.plane((0, -1, 0)))
        >>> bool(roof([[0, -0.5, 0]])[0] > 0)
        True
    """
    return build("intersection", [("k", _check.non_negative("intersection: k", k))], _gather("intersection", shapes))


def difference(*shapes: Union[Shape, Sequence[Shape]], k: float = 0.0) -> Shape:
    """The first of the shapes without the others; `k` >= 0 rounds the edge, world units.

    Examples:
        >>> import sdfrs
        >>> ring = sdfrs.difference(sdfrs.cylinder(1.0), sdfrs.cylinder(0.5, height=2))
        >>> float(ring([[0, 0, 0]])[0])
        0.5
    """
    items = _gather("difference", shapes)
    for item in items:
        if not isinstance(item, Shape):
            raise TypeError(f"difference takes shapes, got {_check.show(item)}")
    first: Shape = items[0]
    return first.difference(*items[1:], k=k)
