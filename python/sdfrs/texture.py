"""`SdfTexture`: an array of samples as a shape.

Node-centred, [z, y, x]; interpolated ``a + f*(b - a)`` along x, then y, then z.
Outside its box the field is ``max(|p - q|, value(q) - |p - q|)``, q the nearest point of the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._errors import SceneError
from .formula import box_bounds
from .shapes import Shape

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Vec3, Vec3Like


class SdfTexture(Shape):
    """A grid of signed distances as a shape: `values_zyx` (nz, ny, nx), float32 or float64, kept as they are.

    Args: `bounds` (lo, hi), the outermost nodes, world units. At least 2 nodes along each axis.
    Raises: SceneError for other shapes, NaN or inf; TypeError for other dtypes.
    Traced with the texture's safe-step rule; ``with_lipschitz(1.0)`` traces the raw values.

    Examples:
        >>> import numpy as np, sdfrs
        >>> z, y, x = np.meshgrid(*[np.linspace(-1, 1, 33)] * 3, indexing="ij")
        >>> ball = sdfrs.SdfTexture(np.sqrt(x*x + y*y + z*z) - 0.5, bounds=((-1, -1, -1), (1, 1, 1)))
        >>> ball.values.shape, ball.spacing
        ((33, 33, 33), (0.0625, 0.0625, 0.0625))
        >>> (ball | sdfrs.plane(point=(0, -0.5, 0))).lipschitz >= 1
        True
    """

    __slots__ = ("_values",)

    def __new__(cls, values_zyx: npt.ArrayLike, bounds: tuple[Vec3Like, Vec3Like]) -> SdfTexture:
        values = np.asarray(values_zyx)
        if values.dtype.type not in (np.float32, np.float64) or not values.dtype.isnative:
            raise TypeError(
                f"SdfTexture: values must be float32 or float64 in native byte order, got dtype {values.dtype}; "
                "use .astype(np.float32)"
            )
        if values.ndim != 3:
            raise SceneError(f"SdfTexture: values must be 3-dimensional, [z, y, x], got shape {values.shape}")
        lo, hi = box_bounds("SdfTexture: bounds", bounds)
        result = object.__new__(cls)
        result._node = _core.Node.texture(np.ascontiguousarray(values), lo, hi)
        return result

    def __init__(self, values_zyx: npt.ArrayLike, bounds: tuple[Vec3Like, Vec3Like]) -> None:
        pass  # made in __new__: Shape refuses to be called

    @property
    def values(self) -> npt.NDArray[Any]:
        """The samples, (nz, ny, nx), read-only.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 3, 4), np.float32), ((0, 0, 0), (3, 2, 1))).values.shape
            (2, 3, 4)
        """
        try:
            return self._values
        except AttributeError:
            self._values: npt.NDArray[Any] = self._node.grid_values()
            self._values.flags.writeable = False
            return self._values

    @property
    def bounds(self) -> tuple[Vec3, Vec3]:
        """The box (lo, hi) of the outermost nodes, world units.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 2, 2)), ((0, 0, 0), (1, 1, 1))).bounds
            ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        """
        return self._node.grid_bounds()

    @property
    def spacing(self) -> Vec3:
        """Distance between neighbouring nodes along x, y, z, world units.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 3, 5)), ((0, 0, 0), (4, 4, 4))).spacing
            (1.0, 2.0, 4.0)
        """
        lo, hi = self.bounds
        nz, ny, nx = self.values.shape
        x, y, z = ((h - l) / (n - 1) for l, h, n in zip(lo, hi, (nx, ny, nz)))
        return (x, y, z)

    @property
    def nbytes(self) -> int:
        """Bytes of the samples.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 2, 2), np.float32), ((0, 0, 0), (1, 1, 1))).nbytes
            32
        """
        return int(self.values.nbytes)

    def sample(self, points: npt.ArrayLike) -> npt.NDArray[Any]:
        """Interpolated values at points, (N, 3) -> (N,), in the samples' own precision.

        Raises: SceneError for other shapes, NaN or inf; TypeError for other dtypes.

        Examples:
            >>> import numpy as np, sdfrs
            >>> ramp = np.broadcast_to(np.arange(3.0), (2, 2, 3))
            >>> sdfrs.SdfTexture(ramp, ((0, 0, 0), (2, 1, 1))).sample([[0.5, 0, 0], [2, 1, 1]])
            array([0.5, 2. ])
        """
        return self(points, precision="f32" if self.values.dtype == np.float32 else "f64")
