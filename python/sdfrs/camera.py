"""Cameras and lights: frozen dataclasses, checked when made.

Row 0 of an image is the top; rays go through pixel centres, row by row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, Optional

from . import _check, _core
from ._errors import SceneError

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Precision, Vec3, Vec3Like
    from .shapes import Shape

_MAX_SIDE = 65536


@dataclass(frozen=True)
class Camera:
    """A view: `Camera.look_at` makes a pinhole, `Camera.orthographic` a parallel one.

    Fields: `fov`, degrees, vertical (pinhole); `extent`, world height of the image (orthographic);
    `width` and `height` in pixels, 1 to 65536 each.
    Raises: SceneError for a target at the origin, an up along the view, a fov outside (0, 180), absurd sizes.

    Examples:
        >>> import sdfrs
        >>> sdfrs.Camera(origin=(0, 0, 5), width=64, height=48).kind
        'pinhole'
        >>> sdfrs.Camera.look_at((3, 2, 4), (3, 2, 4))
        Traceback (most recent call last):
        ...
        sdfrs.SceneError: camera: origin and target must differ, both are (3.0, 2.0, 4.0)
    """

    kind: Literal["pinhole", "orthographic"] = "pinhole"
    origin: Vec3 = (3.0, 2.0, 4.0)
    target: Vec3 = (0.0, 0.0, 0.0)
    up: Vec3 = (0.0, 1.0, 0.0)
    fov: Optional[float] = None
    extent: Optional[float] = None
    width: int = 640
    height: int = 480

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        _check.choice("camera: kind", self.kind, ("pinhole", "orthographic"))
        put("origin", _check.vec3("camera: origin", self.origin))
        put("target", _check.vec3("camera: target", self.target))
        put("up", _check.direction("camera: up", self.up))
        if self.kind == "pinhole":
            fov = 40.0 if self.fov is None else self.fov
            put("fov", _check.ranged("camera: fov", fov, "in (0, 180) degrees", lambda v: 0 < v < 180))
            unused = "extent"
        else:
            put("extent", _check.positive("camera: extent", 2.0 if self.extent is None else self.extent))
            unused = "fov"
        if getattr(self, unused) is not None:
            raise SceneError(f"camera: {unused} has no meaning for a camera of kind {self.kind!r}")
        put("width", _check.integer("camera: width", self.width, 1, _MAX_SIDE))
        put("height", _check.integer("camera: height", self.height, 1, _MAX_SIDE))
        if self.origin == self.target:
            raise SceneError(f"camera: origin and target must differ, both are {self.origin}")
        _core.camera_check(self)

    @classmethod
    def look_at(
        cls,
        origin: Vec3Like = (3, 2, 4),
        target: Vec3Like = (0, 0, 0),
        *,
        up: Vec3Like = (0, 1, 0),
        fov: float = 40.0,
        width: int = 640,
        height: int = 480,
    ) -> Camera:
        """A pinhole camera at `origin` looking at `target`; `fov` is vertical, degrees.

        Examples:
            >>> import sdfrs
            >>> cam = sdfrs.Camera.look_at(origin=(3, 2, 4), target=(0, 0, 0), up=(0, 1, 0), fov=40.0,
            ...                            width=640, height=480)
            >>> cam.fov, cam.width
            (40.0, 640)
        """
        return cls("pinhole", origin, target, up, fov, None, width, height)  # type: ignore[arg-type]

    @classmethod
    def orthographic(
        cls,
        origin: Vec3Like = (3, 2, 4),
        target: Vec3Like = (0, 0, 0),
        *,
        up: Vec3Like = (0, 1, 0),
        extent: float = 2.0,
        width: int = 640,
        height: int = 480,
    ) -> Camera:
        """Parallel rays; the image is `extent` world units high.

        Examples:
            >>> import sdfrs
            >>> sdfrs.Camera.orthographic((0, 0, 5), extent=3.0).extent
            3.0
        """
        return cls("orthographic", origin, target, up, None, extent, width, height)  # type: ignore[arg-type]

    def resized(self, width: int, height: int) -> Camera:
        """The same view in another number of pixels.

        Examples:
            >>> import sdfrs
            >>> sdfrs.Camera.look_at().resized(320, 180).height
            180
        """
        return replace(self, width=width, height=height)

    def rays(self, *, precision: Precision = "f64") -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Origins and unit directions, (H*W, 3) each, pixel centres, row-major from the top left.

        Examples:
            >>> import sdfrs
            >>> o, d = sdfrs.Camera.look_at(width=4, height=3).rays()
            >>> o.shape, d.shape
            ((12, 3), (12, 3))
        """
        return _core.camera_rays(self, _check.choice("precision", precision, ("f32", "f64")))


@dataclass(frozen=True)
class PointLight:
    """A point light without falloff: `position` in world units, linear `color`, `intensity` >= 0.

    Examples:
        >>> import sdfrs
        >>> sdfrs.PointLight((4, 6, 3), intensity=0.8)
        PointLight(position=(4.0, 6.0, 3.0), color=(1.0, 1.0, 1.0), intensity=0.8)
    """

    position: Vec3
    color: Vec3 = (1.0, 1.0, 1.0)
    intensity: float = 1.0

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        put("position", _check.vec3("light: position", self.position))
        color = _check.vec3("light: color", self.color)
        if min(color) < 0:
            raise SceneError(f"light: color must be >= 0 in every channel, got {color}")
        put("color", color)
        put("intensity", _check.non_negative("light: intensity", self.intensity))


def fitted(shape: Shape, width: int = 640, height: int = 480) -> Camera:
    """A camera that sees the shape's bounds; without finite ones it looks from (3, 2, 4) at the origin."""
    lo, hi = shape.bounds
    if not all(map(math.isfinite, (*lo, *hi))):
        return Camera.look_at((3, 2, 4), (0, 0, 0), width=width, height=height)
    middle = [(a + b) / 2 for a, b in zip(lo, hi)]
    radius = max(math.dist(lo, hi) / 2, 1e-9)
    # The sphere about the bounds fits the narrower side of the picture.
    half = math.atan(math.tan(math.radians(20.0)) * min(1.0, width / height))
    away = 1.02 * radius / math.sin(half) / math.sqrt(29.0)
    origin = [m + away * step for m, step in zip(middle, (3.0, 2.0, 4.0))]
    return Camera.look_at(origin, middle, width=width, height=height)


def default_lights(camera: Camera) -> tuple[PointLight, ...]:
    """One light above and to the right of the viewer, as far away as what is looked at."""
    forward = [t - o for o, t in zip(camera.origin, camera.target)]
    distance = math.hypot(*forward)
    fx, fy, fz = (v / distance for v in forward)
    ux, uy, uz = camera.up
    right = (fy * uz - fz * uy, fz * ux - fx * uz, fx * uy - fy * ux)
    size = math.hypot(*right)
    rx, ry, rz = (v / size for v in right)
    above = (ry * fz - rz * fy, rz * fx - rx * fz, rx * fy - ry * fx)
    x, y, z = (o + distance * (0.5 * r + 0.9 * a) for o, r, a in zip(camera.origin, (rx, ry, rz), above))
    return (PointLight((x, y, z)),)
