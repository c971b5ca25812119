"""The class every shape is an instance of: operators, transforms, evaluation.

Y is up, angles are radians, lengths are world units; a shape is negative inside.
Shapes never change: each operation returns a new one that shares its operands.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Optional, Union

from . import _check, _core
from ._errors import SceneError
from .formula import box_bounds, trace_formula

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Precision, Vec3, Vec3Like
    from ._expr import Expr, Point
    from ._progress import Progress
    from .inspection import LipschitzCheck
    from .texture import Dtype, SdfTexture, Stepping

Axis = Literal["x", "y", "z"]


def build(op: str, args: list[tuple[str, Any]], children: list[Any]) -> Shape:
    """A node of the graph; every operand must be a shape."""
    for child in children:
        if not isinstance(child, Shape):
            raise TypeError(f"{op} takes shapes, got {_check.show(child)}")
    return Shape._wrap(_core.Node.build(op, args, [child._node for child in children]))


class Shape:
    """A signed distance function; made by `sphere`, `box`, ..., `shape` and the operations below.

    ``a | b`` is the union, ``a & b`` the intersection, ``a - b`` the difference, ``-a`` and ``~a`` the complement.

    Examples:
        >>> import sdfrs
        >>> s = sdfrs.sphere(1.0) & sdfrs.box((1.5, 1.5, 1.5))
        >>> s -= sdfrs.cylinder(0.5, height=4)
        >>> s([[0, 0, 0], [2, 0, 0]])
        array([0.5 , 1.25], dtype=float32)
    """

    __slots__ = ("__weakref__", "_node")
    _node: _core.Node

    def __init__(self) -> None:
        raise TypeError("a Shape is made by sdfrs.sphere(), sdfrs.box(), @sdfrs.shape, ... and their operations")

    @staticmethod
    def _wrap(node: _core.Node) -> Shape:
        if node.op == "texture":
            from .texture import SdfTexture

            return SdfTexture._of(node)
        result = object.__new__(Shape)
        result._node = node
        return result

    def __repr__(self) -> str:
        lo, hi = self.bounds
        corners = " to ".join("({:g}, {:g}, {:g})".format(*corner) for corner in (lo, hi))
        return f"<sdfrs.{type(self).__name__} {self._node.op}, lipschitz {self.lipschitz:g}, bounds {corners}>"

    def __reduce__(self) -> Any:
        from .scene import shape_from_json

        return shape_from_json, (_core.scene_to_json(self._node, None, None, None, None),)

    def __or__(self, other: Shape) -> Shape:
        return build("union", [("k", 0.0)], [self, other]) if isinstance(other, Shape) else NotImplemented

    def __and__(self, other: Shape) -> Shape:
        return build("intersection", [("k", 0.0)], [self, other]) if isinstance(other, Shape) else NotImplemented

    def __sub__(self, other: Shape) -> Shape:
        return build("difference", [("k", 0.0)], [self, other]) if isinstance(other, Shape) else NotImplemented

    def union(self, *others: Shape, k: float = 0.0) -> Shape:
        """This shape or any of the others; `k` >= 0 is the radius of the blend, world units.

        Raises: SceneError when k is negative or not finite.

        Examples:
            >>> import sdfrs
            >>> pair = sdfrs.sphere(1).union(sdfrs.sphere(1, center=(1.5, 0, 0)), k=0.2)
            >>> float(pair([[0.75, 1.0, 0]])[0]) < 0.25        # the blend fills the groove
            True
        """
        return build("union", [("k", _check.non_negative("union: k", k))], [self, *others])

    def intersection(self, *others: Shape, k: float = 0.0) -> Shape:
        """What this shape and all the others share; `k` >= 0 rounds the edge, world units.

        Raises: SceneError when k is negative or not finite.

        Examples:
            >>> import sdfrs
            >>> lens = sdfrs.sphere(1).intersection(sdfrs.sphere(1, center=(1, 0, 0)))
            >>> float(lens([[0.5, 0, 0]])[0])
            -0.5
        """
        return build("intersection", [("k", _check.non_negative("intersection: k", k))], [self, *others])

    def difference(self, *others: Shape, k: float = 0.0) -> Shape:
        """This shape without the others; `k` >= 0 rounds the edge, world units.

        Raises: SceneError when k is negative or not finite.

        Examples:
            >>> import sdfrs
            >>> bowl = sdfrs.sphere(1).difference(sdfrs.sphere(0.8), k=0.05)
            >>> float(bowl([[0, 0, 0]])[0]) > 0
            True
        """
        k = _check.non_negative("difference: k", k)
        if not others:
            raise SceneError("difference: needs at least one shape to take away, got none")
        cutter = others[0] if len(others) == 1 else build("union", [("k", 0.0)], list(others))
        return build("difference", [("k", k)], [self, cutter])

    def negate(self) -> Shape:
        """The complement: inside becomes outside. The same as ``-shape`` and ``~shape``.

        Examples:
            >>> import sdfrs
            >>> float(sdfrs.sphere(1).negate()([[3, 0, 0]])[0])
            -2.0
        """
        return build("negate", [], [self])

    __neg__ = __invert__ = negate

    def translate(self, offset: Vec3Like) -> Shape:
        """Moved by `offset`, three world units.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).translate((0, 5, 0)).bounds
            ((-1.0, 4.0, -1.0), (1.0, 6.0, 1.0))
        """
        return build("translate", [("offset", _check.vec3("translate: offset", offset))], [self])

    def rotate(self, angle: float, axis: Vec3Like = (0, 1, 0)) -> Shape:
        """Turned about `axis` through the origin by `angle` radians, right-handed.

        Raises: SceneError when the axis is zero.

        Examples:
            >>> import math, sdfrs
            >>> upright = sdfrs.box((4, 1, 1)).rotate(math.pi / 2, axis=(0, 0, 1))
            >>> round(float(upright([[0, 3, 0]])[0]), 6)
            1.0
        """
        args = [("angle", _check.number("rotate: angle", angle)), ("axis", _check.direction("rotate: axis", axis))]
        return build("rotate", args, [self])

    def orient(self, axis: Vec3Like) -> Shape:
        """Turned so that its up axis (y) points along `axis`.

        Raises: SceneError when the axis is zero.

        Examples:
            >>> import sdfrs
            >>> lying = sdfrs.cylinder(0.5, height=4).orient((1, 0, 0))
            >>> round(float(lying([[3, 0, 0]])[0]), 6)
            1.0
        """
        import math

        x, y, z = _check.direction("orient: axis", axis)
        size = math.hypot(x, y, z)
        if math.hypot(x, z) <= 1e-15 * size:
            return self if y > 0 else self.rotate(math.pi, axis=(1, 0, 0))
        return self.rotate(math.atan2(math.hypot(x, z), y), axis=(z / size, 0.0, -x / size))

    def scale(self, factor: Union[float, Vec3Like]) -> Shape:
        """Grown by a number, or by three along x, y, z (then distances become lower bounds).

        Raises: SceneError unless every factor is above 0.

        Examples:
            >>> import sdfrs
            >>> float(sdfrs.sphere(1).scale(2)([[5, 0, 0]])[0])
            3.0
            >>> sdfrs.sphere(1).scale((1, 2, 1)).bounds[1]
            (1.0, 2.0, 1.0)
        """
        return build("scale", [("factors", _check.triple("scale: factor", factor))], [self])

    def repeat(self, period: Union[float, Vec3Like], count: Union[None, int, tuple[int, int, int]] = None) -> Shape:
        """Copies every `period` world units along x, y, z; 0 leaves an axis alone.

        Args: `count` limits the copies to -count..count cells along each axis (None: without end).
        Raises: SceneError when a period is negative or a count is.

        Examples:
            >>> import sdfrs
            >>> balls = sdfrs.sphere(1).repeat((4, 4, 4))
            >>> float(balls([[8, 0, 0]])[0])
            -1.0
        """
        args = [
            ("period", _check.triple("repeat: period", period)),
            ("count", None if count is None else _check.counts("repeat: count", count)),
        ]
        return build("repeat", args, [self])

    def twist(self, rate: float) -> Shape:
        """Turned about y by `rate` radians per world unit of height.

        Examples:
            >>> import sdfrs
            >>> tower = sdfrs.box((1, 4, 1)).twist(0.5)
            >>> tower.lipschitz >= 1
            True
        """
        return build("twist", [("rate", _check.number("twist: rate", rate))], [self])

    def bend(self, rate: float) -> Shape:
        """Bent: the x axis turns about z by `rate` radians per world unit along x.

        Examples:
            >>> import sdfrs
            >>> banana = sdfrs.capsule((-1, 0, 0), (1, 0, 0), 0.2).bend(0.2)
            >>> banana.lipschitz >= 1
            True
        """
        return build("bend", [("rate", _check.number("bend: rate", rate))], [self])

    def elongate(self, amount: Vec3Like) -> Shape:
        """Cut at the origin and pulled apart by `amount` on both sides along x, y, z, world units.

        Examples:
            >>> import sdfrs
            >>> float(sdfrs.sphere(1).elongate((1, 0, 0))([[3, 0, 0]])[0])
            1.0
        """
        return build("elongate", [("amount", _check.vec3("elongate: amount", amount))], [self])

    def mirror(self, axis: Axis) -> Shape:
        """The half where `axis` is positive, and its mirror image.

        Examples:
            >>> import sdfrs
            >>> eyes = sdfrs.sphere(0.5, center=(2, 0, 0)).mirror("x")
            >>> eyes([[-2, 0, 0], [2, 0, 0]])
            array([-0.5, -0.5], dtype=float32)
        """
        return build("mirror", [("axis", _check.choice("mirror: axis", axis, ("x", "y", "z")))], [self])

    def shell(self, thickness: float) -> Shape:
        """The surface alone, `thickness` > 0 world units thick, half on each side.

        Examples:
            >>> import sdfrs
            >>> round(float(sdfrs.sphere(1).shell(0.1)([[0, 0, 0]])[0]), 6)
            0.95
        """
        return build("shell", [("thickness", _check.positive("shell: thickness", thickness))], [self])

    def dilate(self, radius: float) -> Shape:
        """Grown by `radius` >= 0 world units on all sides.

        Examples:
            >>> import sdfrs
            >>> float(sdfrs.box(2).dilate(0.5)([[3, 0, 0]])[0])
            1.5
        """
        return build("dilate", [("radius", _check.non_negative("dilate: radius", radius))], [self])

    def erode(self, radius: float) -> Shape:
        """Shrunk by `radius` >= 0 world units on all sides.

        Examples:
            >>> import sdfrs
            >>> float(sdfrs.sphere(1).erode(0.5)([[3, 0, 0]])[0])
            2.5
        """
        return build("dilate", [("radius", -_check.non_negative("erode: radius", radius))], [self])

    def displace(self, by: Union[Shape, Expr, Callable[[Point], Any]]) -> Shape:
        """The distance plus `by`: a shape, or a function of the point as for `sdfrs.shape`.

        The bound is the sum of both bounds; where it cannot be derived, use `with_lipschitz`.

        Examples:
            >>> import numpy as np, sdfrs
            >>> bumpy = sdfrs.sphere(1).displace(lambda p: 0.05 * np.sin(10 * p.x)).with_lipschitz(1.5)
            >>> bumpy.lipschitz
            1.5
        """
        from ._expr import Expr

        if isinstance(by, (Shape, Expr)):
            node = by._node
        elif callable(by):
            node = trace_formula(by, "displacement")._node
        else:
            raise TypeError(f"displace takes a shape or a function of a point, got {_check.show(by)}")
        return Shape._wrap(_core.Node.build("displace", [], [self._node, node]))

    def with_lipschitz(self, lipschitz: float) -> Shape:
        """The same field, with the bound you vouch for: |f(a) - f(b)| <= lipschitz*|a - b|.

        Examples:
            >>> import sdfrs
            >>> sdfrs.box((1, 4, 1)).twist(0.5).with_lipschitz(1.4).lipschitz
            1.4
        """
        return build("with_lipschitz", [("lipschitz", _check.positive("with_lipschitz: lipschitz", lipschitz))], [self])

    def with_bounds(self, lo: Vec3Like, hi: Vec3Like) -> Shape:
        """The same field, with a box that you say its surface does not leave.

        Examples:
            >>> import sdfrs
            >>> sdfrs.plane().with_bounds((-1, -1, -1), (1, 0, 1)).bounds
            ((-1.0, -1.0, -1.0), (1.0, 0.0, 1.0))
        """
        low, high = box_bounds("with_bounds: bounds", (lo, hi))
        return build("with_bounds", [("lo", low), ("hi", high)], [self])

    @property
    def lipschitz(self) -> float:
        """Certified bound of the slope: 1.0 for distances, inf where none is known.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere().lipschitz
            1.0
        """
        return self._node.lipschitz

    @property
    def bounds(self) -> tuple[Vec3, Vec3]:
        """A box (lo, hi) that holds the solid, world units; infinite where unbounded.

        Examples:
            >>> import sdfrs
            >>> sdfrs.box(2).bounds
            ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
        """
        return self._node.bounds

    def __call__(self, points: npt.ArrayLike, precision: Precision = "f32") -> npt.NDArray[Any]:
        """Values at points: (N, 3) -> (N,), float32 or float64, world units, negative inside.

        Raises: SceneError for other shapes, NaN or inf; TypeError for other dtypes.
        """
        return self._node.values(_check.points("points", points, precision))

    def gradient(self, points: npt.ArrayLike, precision: Precision = "f32") -> npt.NDArray[Any]:
        """Slopes at points by automatic differentiation: (N, 3) -> (N, 3), not normalised.

        Raises: SceneError for other shapes, NaN or inf; TypeError for other dtypes.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).gradient([[0, 3, 0]])
            array([[0., 1., 0.]], dtype=float32)
        """
        return self._node.gradient(_check.points("points", points, precision))

    def interval(self, lo: Vec3Like, hi: Vec3Like) -> tuple[float, float]:
        """Guaranteed bounds of the field's values over the box (lo, hi), in f64.

        Examples:
            >>> import sdfrs
            >>> low, high = sdfrs.sphere(1).interval((2, -1, -1), (3, 1, 1))
            >>> low > 0                                  # the box is empty, for certain
            True
        """
        low, high = _check.vec3("interval: lo", lo), _check.vec3("interval: hi", hi)
        if not all(a <= b for a, b in zip(low, high)):
            raise SceneError(f"interval: must have lo <= hi on every axis, got {low} and {high}")
        return self._node.interval(low, high)

    def to_texture(
        self,
        resolution: Union[int, tuple[int, int, int]] = 128,
        *,
        bounds: Optional[tuple[Vec3Like, Vec3Like]] = None,
        padding: float = 0.1,
        dtype: Dtype = "float32",
        sparse: bool = False,
        band: Optional[float] = None,
        stepping: Stepping = "safe",
        progress: Progress = None,
    ) -> SdfTexture:
        """The shape sampled at the nodes of a grid, as a texture (which is a shape again).

        Args: `resolution` nodes along each axis of a cube, or (nx, ny, nz) of the box itself; `bounds` (lo, hi),
        the outermost nodes (None: the shape's own, grown by `padding` times the longest edge on every side);
        `dtype` of the samples, "uint8" for sparse ones only; `sparse` keeps the bricks of 8^3 cells that come
        within `band` of the surface (None: 4 cells); `stepping` as for `SdfTexture`.
        Raises: SceneError for unbounded shapes without bounds, sparse textures of shapes without a Lipschitz
        bound, and what would need more than half of the memory.

        Examples:
            >>> import sdfrs
            >>> ball = sdfrs.sphere(1).to_texture(65)
            >>> abs(float(ball([[1.1, 0, 0]])[0]) - 0.1) < 0.01
            True
            >>> sdfrs.sphere(1).to_texture(257, sparse=True, dtype="uint8").nbytes < 5_000_000
            True
        """
        from .texture import shape_to_texture

        return shape_to_texture(self, resolution, bounds, padding, dtype, sparse, band, stepping, progress)

    def check(self, *, samples: int = 20_000, seed: int = 0) -> LipschitzCheck:
        """Looks for a pair of points that breaks the declared bound, by random search in f64.

        Args: `samples` pairs at all scales, about the surface and anywhere in the bounds.
        Returns: `LipschitzCheck`; ``ok`` means that none was found, not that there is none.

        Examples:
            >>> import sdfrs
            >>> sdfrs.box(1).check(samples=1000).ok
            True
            >>> sdfrs.sphere(1).scale(2).with_lipschitz(0.5).check(samples=1000).ok
            False
        """
        from .inspection import check_lipschitz

        return check_lipschitz(self, samples, seed)
