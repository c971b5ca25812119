"""Triangle meshes to textures of signed distances: exact, with signs that hold on damaged meshes too.

Distances are exact to the rounding of the box's size. The sign of a closed, oriented mesh comes from the
nearest face's pseudonormal, that of any other from winding numbers; the report says which, and why.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Optional, Union

import numpy as np

from . import _check, _core
from ._errors import MeshError, MissingFileError, SceneError
from ._progress import Progress, reporter
from .formula import box_bounds
from .texture import STEPPINGS, Dtype, SdfTexture, Stepping, band_width, node_counts

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Vec3, Vec3Like

Sign = Literal["auto", "winding", "pseudonormal", "parity", "unsigned"]
SIGNS = ("auto", "winding", "pseudonormal", "parity", "unsigned")
MESH_DTYPES = ("float32", "float16", "uint8")


@dataclass(frozen=True, eq=False)
class MeshReport:
    """What was found in a mesh, and what decided the signs; `SdfTexture.report`.

    Fields: counts of `vertices`, `faces` (as triangles), `degenerate_faces` and `duplicate_faces` (left out),
    `boundary_edges`, `nonmanifold_edges`, `misoriented_edges`, `components`; `watertight`, `manifold`, `oriented`;
    `signed_volume`, cubic world units; `bounds`; `sign`, the method that decided, and `why`; `confidence` of each
    node's sign, (nz, ny, nx) in 0..1, where it was asked for; `seconds`.

    Examples:
        >>> import sdfrs
        >>> square = sdfrs.mesh_to_sdf_texture([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]],
        ...                                    resolution=16, sign="unsigned")
        >>> square.report.watertight, square.report.boundary_edges, square.report.sign
        (False, 4, 'unsigned')
    """

    vertices: int
    faces: int
    degenerate_faces: int
    duplicate_faces: int
    boundary_edges: int
    nonmanifold_edges: int
    misoriented_edges: int
    components: int
    watertight: bool
    manifold: bool
    oriented: bool
    signed_volume: float
    bounds: tuple[Vec3, Vec3]
    sign: str
    why: str
    confidence: Optional[npt.NDArray[np.float32]]
    seconds: float

    def __str__(self) -> str:
        found = [
            f"{self.vertices:,} vertices, {self.faces:,} faces, {self.components:,} components",
            "closed" if self.watertight else f"open: {self.boundary_edges:,} boundary edges",
        ]
        faults = {
            "degenerate faces": self.degenerate_faces,
            "duplicate faces": self.duplicate_faces,
            "non-manifold edges": self.nonmanifold_edges,
            "edges between faces that disagree": self.misoriented_edges,
        }
        found += [f"{count:,} {name}" for name, count in faults.items() if count]
        return "\n".join([*found, f"sign: {self.sign} ({self.why})", f"{self.seconds:.3f} s"])


def mesh_to_sdf_texture(
    mesh: Any,
    faces: Union[None, npt.ArrayLike, Sequence[Sequence[int]]] = None,
    *,
    resolution: Union[int, tuple[int, int, int]] = 128,
    bounds: Optional[tuple[Vec3Like, Vec3Like]] = None,
    padding: float = 0.1,
    sign: Sign = "auto",
    sparse: bool = False,
    band: Optional[float] = None,
    dtype: Dtype = "float32",
    confidence: bool = False,
    stepping: Stepping = "safe",
    progress: Progress = None,
) -> SdfTexture:
    """Signed distances of a triangle mesh at the nodes of a grid, as a texture.

    Args: `mesh` a path (OBJ, STL, PLY, OFF, GLB), an object with `.vertices` and `.faces` such as trimesh.Trimesh,
    or vertices (N, 3) with `faces` (F, 3), (F, 4) or a list of polygons. `resolution` nodes along each axis of a
    cube about the mesh, or (nx, ny, nz) over its box; `bounds` (lo, hi) are the outermost nodes, taken exactly
    (None: the mesh's box, grown by `padding` times its longest edge on every side). `sign` "auto" (pseudonormals
    for closed, oriented, manifold meshes, else winding numbers) or a method by name. `sparse` keeps the
    bricks of 8^3 cells near the surface; `band`, world units, is where distances are cut (None: 4 cells of a sparse
    texture, a dense one is not cut). `dtype` "float32", "float16", or "uint8"
    for sparse textures. `confidence` adds how sure each sign is to the report. `stepping` as for `SdfTexture`.
    Returns: `SdfTexture`; `.report` says what was found, `.max_error` bounds the error of every sample.
    Raises: MeshError for what cannot be baked, with the file and the element; MissingFileError
    where there is no such file; TypeError for other types.

    Examples:
        >>> import numpy as np, sdfrs
        >>> corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        >>> sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        >>> tex = sdfrs.mesh_to_sdf_texture(corners, sides, resolution=32)
        >>> tex.report.watertight, tex.report.sign
        (True, 'pseudonormal')
        >>> tex.sample([[0.5, 0.5, 0.5]]).round(2)
        array([-0.48], dtype=float32)
    """
    settings = _settings(resolution, bounds, padding, sign, sparse, band, dtype, confidence, stepping)
    triangles = _triangles(mesh, faces)
    with reporter(progress, "mesh_to_sdf_texture", "node") as callback:
        node, found = _core.mesh_to_texture(triangles, settings, callback)
    lo, hi = found["bounds"]
    return SdfTexture._of(node, MeshReport(**{**found, "bounds": (tuple(lo), tuple(hi))}))


def _settings(
    resolution: Any, bounds: Any, padding: Any, sign: Any, sparse: Any, band: Any, dtype: Any, confidence: Any,
    stepping: Any,
) -> dict[str, Any]:  # fmt: skip
    """Everything but the mesh, checked; whatever is wrong is a MeshError."""
    try:
        counts = node_counts("resolution", resolution)
        for flag, name in ((sparse, "sparse"), (confidence, "confidence")):
            if not isinstance(flag, (bool, np.bool_)):
                raise TypeError(f"{name} must be True or False, got {_check.show(flag)}")
        kind = _check.choice("dtype", dtype, MESH_DTYPES)
        if kind == "uint8":
            band_width("mesh_to_sdf_texture", bool(sparse), None, kind)
        return {
            "resolution": counts,
            "cube": not isinstance(resolution, (tuple, list, np.ndarray)),
            "bounds": None if bounds is None else box_bounds("bounds", bounds),
            "padding": _check.non_negative("padding", padding),
            "sign": _check.choice("sign", sign, SIGNS),
            "sparse": bool(sparse),
            "band": None if band is None else _check.positive("band", band),
            "dtype": kind,
            "confidence": bool(confidence),
            "stepping": _check.choice("stepping", stepping, STEPPINGS),
        }
    except SceneError as error:
        raise MeshError(f"mesh_to_sdf_texture: {error}") from None


def _triangles(mesh: Any, faces: Any) -> _core.Triangles:
    """Triangles of a path, an object with vertices and faces, or arrays."""
    if isinstance(mesh, (str, os.PathLike)):
        if faces is not None:
            raise TypeError("mesh_to_sdf_texture: a file has its own faces, so faces must be None")
        path = os.fspath(mesh)
        if not os.path.exists(path):
            raise MissingFileError(f"no file {path!r}")
        return _core.Triangles.read(path)
    if faces is None:
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError(
                "mesh_to_sdf_texture takes a path, an object with .vertices and .faces, or vertices and faces, got "
                + _check.show(mesh)
            )
        mesh, faces = mesh.vertices, mesh.faces
    return _core.Triangles.of_arrays(_vertices(mesh), *_polygons(faces))


def _vertices(value: Any) -> npt.NDArray[np.float64]:
    try:
        raw = np.asarray(value)
    except ValueError:
        raise MeshError("vertices must be an array of shape (N, 3), got rows of unequal length") from None
    if raw.size == 0:
        raise MeshError("vertices: the mesh is empty, it has no vertices")
    if raw.dtype.kind not in "fiu":
        raise TypeError(f"vertices must be an array of real numbers, got dtype {raw.dtype}")
    if raw.ndim != 2 or raw.shape[1] != 3:
        raise MeshError(f"vertices must have shape (N, 3), got {raw.shape}")
    return np.ascontiguousarray(raw, dtype=np.float64)


def _polygons(value: Any) -> tuple[npt.NDArray[np.int64], Any]:
    """The corners of all polygons one after the other, and each one's count (or one for all)."""
    try:
        raw = np.asarray(value)
    except ValueError:
        raw = None  # ragged
    if raw is not None and raw.dtype == object:
        raw = None
    if raw is None:
        rows = [_corners(i, polygon) for i, polygon in enumerate(value)]
        return np.concatenate(rows), np.array([len(row) for row in rows], dtype=np.uint32)
    if raw.size == 0:
        raise MeshError("faces: the mesh is empty, it has no faces")
    if raw.dtype.kind not in "iu":
        raise TypeError(f"faces must be whole numbers, got dtype {raw.dtype}")
    if raw.ndim != 2 or raw.shape[1] < 3:
        raise MeshError(f"faces must have shape (F, 3) or (F, 4), or be a list of polygons, got {raw.shape}")
    return np.ascontiguousarray(_narrow(raw)).reshape(-1), int(raw.shape[1])


def _corners(face: int, polygon: Any) -> npt.NDArray[np.int64]:
    row = np.asarray(polygon)
    if row.dtype.kind not in "iu" or row.ndim != 1:
        raise TypeError(f"faces: face {face} must be a list of whole numbers, got {_check.show(polygon)}")
    return _narrow(row)


def _narrow(raw: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """Indices as int64; those that do not fit are as wrong as the largest that does."""
    if raw.dtype == np.uint64:
        raw = np.minimum(raw, np.uint64(2**63 - 1))
    return raw.astype(np.int64)
