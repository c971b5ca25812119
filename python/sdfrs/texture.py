"""`SdfTexture`: samples on a grid as a shape, all of them or those near the surface alone.

Node-centred, [z, y, x]; interpolated ``a + f*(b - a)`` along x, then y, then z.
Outside its box the field is ``max(|p - q|, value(q) - |p - q|)``, q the nearest point of the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Optional

import numpy as np

from . import _check, _core
from ._errors import SceneError
from .formula import box_bounds
from .shapes import Shape

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Vec3, Vec3Like
    from ._files import PathLike
    from ._progress import Progress
    from .mesh import MeshReport

Stepping = Literal["safe", "bricks", "voxel"]
Dtype = Literal["float32", "float16", "uint8", "float64"]
STEPPINGS = ("safe", "bricks", "voxel")
DTYPES = ("float32", "float16", "uint8", "float64")


def facts_of(
    lo: Vec3, hi: Vec3, stepping: str = "safe", lipschitz: Optional[float] = None, max_error: float = 0.0
) -> dict[str, Any]:
    """What the compiled module wants to know besides the samples."""
    return {"lo": lo, "hi": hi, "lipschitz": lipschitz, "max_error": max_error, "stepping": stepping}


class SdfTexture(Shape):
    """A grid of signed distances as a shape: `values_zyx` (nz, ny, nx), float16, float32 or float64, kept as they are.

    Args: `bounds` (lo, hi), the outermost nodes, world units; at least 2 nodes along each axis. `stepping` is how
    a tracer turns values into steps: "safe", one rule for all, "bricks", each 8^3 cells' own slope as well,
    "voxel", the exact root in each voxel for a texture traced by itself (elsewhere as "bricks").
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

    __slots__ = ("_known", "_report", "_values")
    _report: Optional[MeshReport]

    def __new__(
        cls, values_zyx: npt.ArrayLike, bounds: tuple[Vec3Like, Vec3Like], *, stepping: Stepping = "safe"
    ) -> SdfTexture:
        values = np.asarray(values_zyx)
        if values.dtype.type not in (np.float16, np.float32, np.float64) or not values.dtype.isnative:
            raise TypeError(
                f"SdfTexture: values must be float16, float32 or float64 in native byte order, got dtype "
                f"{values.dtype}; use .astype(np.float32)"
            )
        if values.ndim != 3:
            raise SceneError(f"SdfTexture: values must be 3-dimensional, [z, y, x], got shape {values.shape}")
        lo, hi = box_bounds("SdfTexture: bounds", bounds)
        name = _check.choice("SdfTexture: stepping", stepping, STEPPINGS)
        return cls._of(_core.texture_dense(np.ascontiguousarray(values), facts_of(lo, hi, name)))

    def __init__(
        self, values_zyx: npt.ArrayLike, bounds: tuple[Vec3Like, Vec3Like], *, stepping: Stepping = "safe"
    ) -> None:
        pass  # made in __new__: Shape refuses to be called

    @staticmethod
    def _of(node: _core.Node, report: Optional[MeshReport] = None) -> SdfTexture:
        result = object.__new__(SdfTexture)
        result._node, result._report = node, report
        return result

    @property
    def _facts(self) -> dict[str, Any]:
        try:
            return self._known
        except AttributeError:
            self._known: dict[str, Any] = _core.texture_facts(self._node)
            return self._known

    @property
    def values(self) -> npt.NDArray[Any]:
        """The samples of a dense texture, (nz, ny, nx), read-only.

        Raises: SceneError for a sparse one, which has no such array: see `to_dense`.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 3, 4), np.float32), ((0, 0, 0), (3, 2, 1))).values.shape
            (2, 3, 4)
        """
        try:
            return self._values
        except AttributeError:
            self._values: npt.NDArray[Any] = self._all()
            self._values.flags.writeable = False
            return self._values

    def _all(self) -> npt.NDArray[Any]:
        if self.sparse:
            raise SceneError("texture: it is sparse; use .to_dense() for all samples")
        return _core.texture_samples(self._node, 0, self.shape_zyx[0]).reshape(self.shape_zyx)

    @property
    def shape_zyx(self) -> tuple[int, int, int]:
        """Nodes along z, y, x.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture((8, 16, 32), bounds=((-1, -1, -1), (1, 1, 1))).shape_zyx
            (32, 16, 8)
        """
        nx, ny, nz = self._facts["dims"]
        return (nz, ny, nx)

    @property
    def sparse(self) -> bool:
        """Whether only bricks near the surface are kept; beyond them values are lower bounds.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(64, sparse=True).sparse
            True
        """
        return self._facts["kept"] is not None

    @property
    def dtype(self) -> np.dtype[Any]:
        """What a sample is stored as.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(16, dtype="float16").dtype
            dtype('float16')
        """
        return np.dtype(self._facts["dtype"])

    @property
    def stepping(self) -> str:
        """How a tracer turns values into steps: "safe", "bricks" or "voxel".

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(16, stepping="bricks").stepping
            'bricks'
        """
        return str(self._facts["stepping"])

    @property
    def bounds(self) -> tuple[Vec3, Vec3]:
        """The box (lo, hi) of the outermost nodes, world units.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 2, 2)), ((0, 0, 0), (1, 1, 1))).bounds
            ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        """
        return tuple(self._facts["lo"]), tuple(self._facts["hi"])

    @property
    def spacing(self) -> Vec3:
        """Distance between neighbouring nodes along x, y, z, world units.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 3, 5)), ((0, 0, 0), (4, 4, 4))).spacing
            (1.0, 2.0, 4.0)
        """
        return tuple(self._facts["spacing"])

    @property
    def nbytes(self) -> int:
        """Bytes of the samples, and of a sparse texture's table.

        Examples:
            >>> import numpy as np, sdfrs
            >>> sdfrs.SdfTexture(np.ones((2, 2, 2), np.float32), ((0, 0, 0), (1, 1, 1))).nbytes
            32
        """
        return int(self._facts["nbytes"])

    @property
    def max_error(self) -> float:
        """Largest difference of a sample and the field it stands for (the exact distance of a mesh), certified.

        Between nodes interpolation adds up to half a cell's diagonal, for smooth surfaces far less. 0 for arrays
        that were handed over.

        Examples:
            >>> import sdfrs
            >>> 0 < sdfrs.sphere(1).to_texture(32, dtype="float16").max_error < 1e-3
            True
        """
        return float(self._facts["max_error"])

    @property
    def report(self) -> Optional[MeshReport]:
        """What was found in the mesh it was baked from (`MeshReport`); None for other textures.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(16).report is None
            True
        """
        return self._report

    @property
    def brick_slopes(self) -> npt.NDArray[np.float32]:
        """Certified slope of the interpolant in each brick of 8^3 cells, [z, y, x].

        Examples:
            >>> import sdfrs
            >>> slopes = sdfrs.sphere(1).to_texture(33).brick_slopes
            >>> slopes.shape, bool(slopes.max() < 1.74)
            ((4, 4, 4), True)
        """
        nx, ny, nz = self._facts["bricks"]
        return _core.texture_slopes(self._node, 0, nx * ny * nz).reshape(nz, ny, nx)

    def with_stepping(self, stepping: Stepping) -> SdfTexture:
        """The same samples, walked by another rule.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(16).with_stepping("bricks").stepping
            'bricks'
        """
        name = _check.choice("with_stepping: stepping", stepping, STEPPINGS)
        return self._of(_core.texture_changed(self._node, False, name), self.report)

    def to_dense(self) -> SdfTexture:
        """The same texture with a sample at every node, float32 where it was sparse.

        Far from the surface the values are lower bounds of the distance.
        Raises: SceneError where that needs more than half of the memory.

        Examples:
            >>> import sdfrs
            >>> sdfrs.sphere(1).to_texture(64, sparse=True).to_dense().values.shape
            (64, 64, 64)
        """
        return self._of(_core.texture_changed(self._node, True, None), self.report) if self.sparse else self

    def sample(self, points: npt.ArrayLike) -> npt.NDArray[Any]:
        """Interpolated values at points, (N, 3) -> (N,), in the samples' own precision.

        Raises: SceneError for other shapes, NaN or inf; TypeError for other dtypes.

        Examples:
            >>> import numpy as np, sdfrs
            >>> ramp = np.broadcast_to(np.arange(3.0), (2, 2, 3))
            >>> sdfrs.SdfTexture(ramp, ((0, 0, 0), (2, 1, 1))).sample([[0.5, 0, 0], [2, 1, 1]])
            array([0.5, 2. ])
        """
        return self(points, precision="f64" if self.dtype == np.float64 else "f32")

    def save(self, path: PathLike) -> None:
        """Writes the texture, whole or not at all: .npz (`sdfrs.load` reads it), .raw with a .json beside it, or .vol.

        .raw and .vol (Mitsuba's grid volume) take dense samples: a sparse texture's are those of `to_dense`, in slabs, so that
        there need not be memory for all of them.
        Raises: SceneError for another ending; OSError where the file cannot be written. See docs/texture-format.md.

        Examples:
            >>> import os, tempfile, sdfrs
            >>> path = os.path.join(tempfile.mkdtemp(), "ball.npz")
            >>> sdfrs.sphere(1).to_texture(32, sparse=True).save(path)
            >>> sdfrs.load(path).shape_zyx
            (32, 32, 32)
        """
        from .texture_file import save

        save(self, path)


def node_counts(where: str, value: Any) -> tuple[int, int, int]:
    """Nodes along x, y, z: one number for all, or three."""
    items = tuple(value) if isinstance(value, (tuple, list, np.ndarray)) else (value, value, value)
    if len(items) != 3:
        raise SceneError(f"{where} must be an integer or three, got {_check.show(value)}")
    x, y, z = (_check.integer(where, item, 2, 2**16) for item in items)
    return (x, y, z)


def shape_to_texture(
    shape: Shape, resolution: Any, bounds: Any, padding: float, dtype: str, sparse: bool, band: Optional[float],
    stepping: str, progress: Progress,
) -> SdfTexture:  # fmt: skip
    """What `Shape.to_texture` does."""
    from ._progress import reporter

    counts = node_counts("to_texture: resolution", resolution)
    if bounds is None:
        lo, hi = padded(shape.bounds, _check.non_negative("to_texture: padding", padding))
        if not all(np.isfinite(lo + hi)):
            raise SceneError("to_texture: the shape is unbounded, pass bounds=(lo, hi)")
        if not isinstance(resolution, (tuple, list, np.ndarray)):
            lo, hi = cube(lo, hi)
    else:
        lo, hi = box_bounds("to_texture: bounds", bounds)
    dtype = _check.choice("to_texture: dtype", dtype, DTYPES)
    width = band_width("to_texture", sparse, band, dtype)
    stepping = _check.choice("to_texture: stepping", stepping, STEPPINGS)
    with reporter(progress, "to_texture", "node") as callback:
        node = _core.texture_of_shape(shape._node, counts, lo, hi, width, dtype, stepping, callback)
    return SdfTexture._of(node)


def band_width(where: str, sparse: bool, band: Optional[float], dtype: str) -> Optional[float]:
    """None for a dense texture, 0 for the usual band."""
    if dtype == "uint8" and not sparse:
        raise SceneError(f"{where}: dtype 'uint8' needs sparse=True: bytes only reach over a narrow band")
    if dtype == "float64" and sparse:
        raise SceneError(f"{where}: sparse textures are 'float32', 'float16' or 'uint8', got 'float64'")
    if band is None:
        return 0.0 if sparse else None
    width = _check.positive(f"{where}: band", band)
    if not sparse:
        raise SceneError(f"{where}: band needs sparse=True")
    return width


def padded(bounds: tuple[Vec3, Vec3], padding: float) -> tuple[Vec3, Vec3]:
    """A box grown on all sides by `padding` times its longest edge."""
    lo, hi = (np.array(corner) for corner in bounds)
    by = padding * float((hi - lo).max())
    to_vec = lambda v: (float(v[0]), float(v[1]), float(v[2]))  # noqa: E731
    return to_vec(lo - by), to_vec(hi + by)


def cube(lo: Vec3, hi: Vec3) -> tuple[Vec3, Vec3]:
    """The least cube about the middle of a box that holds it."""
    half = max(h - l for l, h in zip(lo, hi)) / 2
    x, y, z = ((l + h) / 2 for l, h in zip(lo, hi))
    return (x - half, y - half, z - half), (x + half, y + half, z + half)
