"""sdfrs: signed distance functions, sphere traced.

Shapes are made by functions and operators, looked at by a camera, rendered by one of
six tracers that count what they do. Y is up, angles are radians (a camera's fov degrees),
lengths are world units, a shape is negative inside, row 0 of an image is the top.
"""

from . import _environment
from . import scenes as scenes
from ._core import __version__ as __version__
from ._errors import (
    DeviceError,
    Error,
    FormatError,
    InternalError,
    LipschitzWarning,
    MeshError,
    MissingFileError,
    SceneError,
)
from ._expr import Condition, Expr, Point
from .camera import Camera, PointLight
from .formula import clamp, length, max, min, mix, shape, where
from .image import Image
from .inspection import LipschitzCheck
from .mesh import MeshReport, mesh_to_sdf_texture
from .primitives import (
    box,
    capsule,
    cone,
    cylinder,
    difference,
    ellipsoid,
    gyroid,
    intersection,
    mandelbulb,
    plane,
    rounded_box,
    sphere,
    torus,
    union,
)
from .render import render, set_threads, trace, trace_stats
from .results import Hits, Settings, Stats, Summary, Timings
from .scene import Scene, load
from .shapes import Shape
from .texture import SdfTexture
from .tracers import AutoRelaxed, Basic, BinarySearch, CoverageSearch, Enhanced, Relaxed, Tracer

__all__ = [
    "AutoRelaxed", "Basic", "BinarySearch", "Camera", "Condition", "CoverageSearch", "DeviceError", "Enhanced", "Error",
    "Expr", "FormatError", "Hits", "Image", "InternalError", "LipschitzCheck", "LipschitzWarning", "MeshError", "MeshReport", "MissingFileError", "Point", "PointLight",
    "Relaxed", "Scene", "SceneError", "SdfTexture", "Settings", "Shape", "Stats", "Summary", "Timings", "Tracer",
    "box", "capsule", "clamp", "cone", "cylinder", "difference", "ellipsoid", "gyroid", "intersection", "length", "load",
    "mandelbulb", "max", "mesh_to_sdf_texture", "min", "mix", "plane", "render", "rounded_box", "scenes", "set_threads", "shape", "sphere",
    "torus", "trace", "trace_stats", "union", "where",
]  # fmt: skip

_environment.check()
