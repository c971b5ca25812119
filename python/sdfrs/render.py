"""Tracing rays, measuring a run, rendering a picture.

The compiled module computes without the GIL; Ctrl-C stops it within 0.2 s.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _check, _core
from ._errors import LipschitzWarning, SceneError
from ._progress import Progress, reporter
from .camera import Camera, PointLight, default_lights, fitted
from .image import Image
from .results import Hits, Settings, Stats, Summary, Timings
from .scene import Scene, as_camera, as_lights, as_scene
from .shapes import Shape
from .tracers import TracerLike, as_tracer

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from ._check import Precision, Prune


def set_threads(count: int) -> None:
    """How many threads compute from now on; 0 is the default: SDFRS_THREADS, else all cores.

    Results are the same bits for any number.

    Examples:
        >>> import sdfrs
        >>> sdfrs.set_threads(1)
        >>> sdfrs.set_threads(0)
    """
    _core.set_threads(_check.integer("set_threads: count", count, 0, 1024))


def _limits(eps: float, cone: float, max_steps: int) -> tuple[float, float, int]:
    return (
        _check.positive("eps", eps),
        _check.non_negative("cone", cone),
        _check.integer("max_steps", max_steps, 1, 2**31 - 1),
    )


def _span(where: str, value: Any, count: int, precision: str) -> Any:
    if np.ndim(value) == 0 and not isinstance(value, (str, bytes)):
        return _check.number(where, value)
    result = _check.array(where, value, precision)
    if result.shape != (count,):
        raise SceneError(f"{where} must be a number or have shape ({count},), got {result.shape}")
    return result


def _shape_of(what: Any) -> Shape:
    return as_scene(what).shape


def trace(
    shape: Union[Shape, Scene],
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    *,
    tracer: TracerLike = "auto_relaxed",
    eps: float = 1e-4,
    cone: float = 0.0,
    t_min: Union[float, npt.ArrayLike] = 0.0,
    t_max: Union[float, npt.ArrayLike] = 100.0,
    max_steps: int = 1000,
    precision: Precision = "f32",
    device: str = "auto",
    prune: Prune = "auto",
    strict: bool = False,
    progress: Progress = None,
) -> Hits:
    """Traces rays: `origins` and unit `directions`, (N, 3) each; returns `Hits` of (N,) arrays.

    Args: a sample at t is a hit when its value is at most max(eps, cone*t), world units; rays run from
    `t_min` to `t_max` (numbers or (N,)); `max_steps` counts evaluations of the field; `precision` "f32" or "f64";
    `device` and `strict` as for `render`.
    `prune`: "exact" drops operands that cannot win in a cell and keeps every value and count, "skip" steps over
    empty cells and leaves out what a cell's rays cannot meet (the same status, other steps), "off" does neither, "auto" is exact where it pays. A GPU prunes
    along the rays of cameras, not those of a batch.
    Raises: SceneError for NaN, inf, directions off unit length by more than 1e-3, settings out of range;
    DeviceError for a device that this machine lacks.

    Examples:
        >>> import sdfrs
        >>> h = sdfrs.trace(sdfrs.sphere(1.0), [[0, 0, 3], [0, 5, 3]], [[0, 0, -1], [0, 0, -1]], precision="f64")
        >>> h.status
        array([1, 0], dtype=uint8)
        >>> h.t.round(3)
        array([ 2., inf])
    """
    node = _shape_of(shape)._node
    tracer = as_tracer(tracer)
    eps, cone, max_steps = _limits(eps, cone, max_steps)
    _check.choice("prune", prune, _check.PRUNE)
    device, strict = _check.device(device), _check.boolean("strict", strict)
    o, d = _check.points("origins", origins, precision), _check.points("directions", directions, precision)
    if len(o) != len(d):
        raise SceneError(f"origins and directions must be as many, got {len(o)} and {len(d)}")
    lower, upper = _span("t_min", t_min, len(o), precision), _span("t_max", t_max, len(o), precision)
    with reporter(progress, "trace") as callback:
        found = _core.trace(
            node, tracer.name, tracer._parts(), o, d, lower, upper, eps, cone, max_steps, prune,
            device, strict, callback,
        )  # fmt: skip
    _warn_software(found.pop("software"), found["device"])
    return Hits(**{**found, "summary": Summary(**found["summary"])})


def fitted_camera(shape: Shape, t_max: float, width: int = 640, height: int = 480, stacklevel: int = 2) -> Camera:
    """A camera that fits the shape; warns when the rays end before the shape does."""
    camera = fitted(shape, width, height)
    far = reach(shape, camera)
    if far > t_max:
        warnings.warn(
            f"t_max={t_max:g} ends before the shape does, {far:.4g} from the fitted camera: pass t_max={far:.4g}",
            stacklevel=stacklevel,
        )
    return camera


def reach(shape: Shape, camera: Camera) -> float:
    """How far rays have to go to have passed the shape; 0 where it is unbounded."""
    far = math.dist(camera.origin, camera.target) + math.dist(*shape.bounds) / 2
    return far if math.isfinite(far) else 0.0


def _view(what: Any, camera: Optional[Camera], t_max: float) -> tuple[Scene, Camera]:
    """The scene, and the camera: the one given, else the scene's own, else one that fits."""
    scene = as_scene(what)
    given = as_camera("camera", camera)
    chosen = given if given is not None else scene.camera
    if chosen is None:
        chosen = fitted_camera(scene.shape, t_max, stacklevel=4)
    return scene, chosen


def _warn_slope(shape: Shape, summary: Summary) -> None:
    # Few rays of a coarse picture are no evidence worth a warning, nor are the steps of textures, which are
    # safe distances that jump from brick to brick.
    if not shape._node.textured and summary.rays >= 1000 and math.isfinite(summary.witness) and summary.witness > 1.01:
        need = math.ceil(summary.lipschitz_observed * 1000) / 1000
        warnings.warn(
            f"the field is {summary.witness:.4g} times as steep as declared, so surfaces may be missed: "
            f"declare .with_lipschitz({need:g}) or more (declared: {shape.lipschitz:g})",
            LipschitzWarning,
            stacklevel=3,
        )


def _warn_short(shape: Shape, camera: Camera, t_max: float, summary: Summary) -> None:
    """Says so where nothing is hit because all rays end before the shape begins."""
    if summary.misses < summary.rays or not np.isfinite(shape.bounds).all():
        return
    corners = np.stack(np.meshgrid(*np.transpose(shape.bounds)), axis=-1).reshape(-1, 3) - camera.origin
    forward = np.subtract(camera.target, camera.origin)
    near = float((corners @ forward).min() / np.linalg.norm(forward))
    # Where a camera is fitted, that has been said already.
    if near > t_max and camera != fitted(shape, camera.width, camera.height):
        far = float(np.linalg.norm(corners, axis=-1).max())
        warnings.warn(
            f"t_max={t_max:g} ends before the shape begins, {near:.4g} ahead of the camera: pass t_max={far:.4g}",
            stacklevel=3,
        )


def _warn_software(software: bool, device: str) -> None:
    if software:
        warnings.warn(
            f"{device}: this GPU is a driver that runs on the processor; device='cpu' is faster", stacklevel=3
        )


def trace_stats(
    scene_or_shape: Union[Scene, Shape],
    camera: Optional[Camera] = None,
    *,
    tracer: TracerLike = "auto_relaxed",
    eps: float = 1e-4,
    cone: float = 0.0,
    max_steps: int = 1000,
    t_max: float = 100.0,
    precision: Precision = "f32",
    device: str = "auto",
    prune: Prune = "auto",
    strict: bool = False,
    progress: Progress = None,
) -> Stats:
    """Traces a camera's rays and returns maps (H, W) and the numbers of the run, without shading.

    Args: as for `render`; `prune` "auto" is exact, so that counts are those of the whole scene.
    Raises: as `render` does. Warns (LipschitzWarning) when the field is steeper than declared.

    Examples:
        >>> import sdfrs
        >>> st = sdfrs.trace_stats(sdfrs.sphere(1), sdfrs.Camera.look_at(width=16, height=12), tracer="basic")
        >>> st.status.shape, st.summary.out_of_steps
        ((12, 16), 0)
    """
    tracer = as_tracer(tracer)
    eps, cone, max_steps = _limits(eps, cone, max_steps)
    _check.choice("prune", prune, _check.PRUNE)
    t_max = _check.positive("t_max", t_max)
    device, strict = _check.device(device), _check.boolean("strict", strict)
    _check.choice("precision", precision, ("f32", "f64"))
    scene, cam = _view(scene_or_shape, camera, t_max)
    with reporter(progress, "trace") as callback:
        found = _core.trace_camera(
            scene.shape._node, cam, tracer.name, tracer._parts(), t_max, eps, cone, max_steps, prune,
            precision, device, strict, callback,
        )  # fmt: skip
    used = found.pop("device")
    _warn_software(found.pop("software"), used)
    maps = {name: value.reshape(cam.height, cam.width) for name, value in found.items() if name != "summary"}
    summary = Summary(**found["summary"])
    _warn_slope(scene.shape, summary)
    _warn_short(scene.shape, cam, t_max, summary)
    settings = Settings(
        tracer, eps, cone, max_steps, t_max, precision, used, _core.threads(), cam, None, None, None,
        _core.__version__, prune,
    )  # fmt: skip
    return Stats(
        status=maps["status"], steps=maps["steps"], fallbacks=maps["fallbacks"], multiplier=maps["multiplier"],
        depth=maps["t"], flags=maps["flags"], summary=summary, settings=settings,
    )  # fmt: skip


def render(
    scene_or_shape: Union[Scene, Shape],
    camera: Optional[Camera] = None,
    *,
    tracer: TracerLike = "auto_relaxed",
    eps: float = 1e-4,
    cone: float = 0.0,
    max_steps: int = 1000,
    t_max: float = 100.0,
    precision: Precision = "f32",
    device: str = "auto",
    prune: Prune = "auto",
    strict: bool = False,
    lights: Optional[Sequence[PointLight]] = None,
    progress: Progress = None,
) -> Image:
    """Renders a scene or a bare shape; returns an `Image`.

    Args: without `camera` the scene's own is used, else one that fits the shape's bounds; without `lights` the
    scene's own, else one beside the viewer. A sample at t is a hit when its value is at most max(eps, cone*t),
    world units; `max_steps` counts evaluations of the field; `progress` True or a function of (done, total).
    `device` "cpu", "gpu" (any), "gpu:N" (the N-th of `sdfrs doctor`), or "auto": a real GPU where there is one
    and it is worth the way, else the CPU; `img.device` says which and why. GPUs compute in f32; `strict` keeps
    every rounding there, so that the result has the CPU's bits where the driver rounds correctly.
    `prune` as for `trace`, but "auto" may skip.
    Raises: SceneError for settings out of range and images too large for the memory; DeviceError for a device
    that this machine lacks. Warns (LipschitzWarning) when the field is steeper than declared.

    Examples:
        >>> import sdfrs
        >>> img = sdfrs.render(sdfrs.sphere(1.0), sdfrs.Camera.look_at(width=64, height=48), tracer="enhanced")
        >>> img.rgb.shape, img.rgb.dtype.name, bool(img.hit[24, 32])
        ((48, 64, 3), 'uint8', True)
    """
    tracer = as_tracer(tracer)
    eps, cone, max_steps = _limits(eps, cone, max_steps)
    _check.choice("prune", prune, _check.PRUNE)
    t_max = _check.positive("t_max", t_max)
    device, strict = _check.device(device), _check.boolean("strict", strict)
    _check.choice("precision", precision, ("f32", "f64"))
    scene, cam = _view(scene_or_shape, camera, t_max)
    shone = as_lights("lights", lights)
    shone = scene.lights if shone is None else shone
    shone = default_lights(cam) if shone is None else shone
    with reporter(progress, "render") as callback:
        found = _core.render(
            scene.shape._node, cam, shone, scene.background, scene.albedo, tracer.name, tracer._parts(),
            t_max, eps, cone, max_steps, prune, precision, device, strict, callback,
        )  # fmt: skip
    _warn_software(found["software"], found["device"])
    size = (cam.height, cam.width)
    summary = Summary(**found["summary"])
    _warn_slope(scene.shape, summary)
    _warn_short(scene.shape, cam, t_max, summary)
    return Image(
        rgb=found["rgb"].reshape(*size, 3),
        depth=found["t"].reshape(size),
        normals=found["normals"].reshape(*size, 3),
        status=found["status"].reshape(size),
        steps=found["steps"].reshape(size),
        fallbacks=found["fallbacks"].reshape(size),
        multiplier=found["multiplier"].reshape(size),
        summary=summary,
        device=found["device"],
        settings=Settings(
            tracer, eps, cone, max_steps, t_max, precision, found["device"], _core.threads(), cam, shone,
            scene.background, scene.albedo, _core.__version__, prune,
        ),
        timings=Timings(found["trace_seconds"], found["shade_seconds"]),
    )  # fmt: skip
