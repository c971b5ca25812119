"""A scene is what a file holds: a shape with its camera, lights and background.

Files are versioned JSON, described in docs/; reading one runs no code of it.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Optional, overload

from . import _check, _core
from ._errors import FormatError, MissingFileError, SceneError
from ._files import PathLike, atomic_write
from .camera import Camera, PointLight
from .shapes import Shape

if TYPE_CHECKING:
    from ._check import Vec3


SceneName = Literal[
    "csg", "village", "composition", "mandelbulb", "gyroid", "spheres1000", "grazing_plane", "thin_shell", "near_miss"
]
# How a zip file, and so an .npz, begins.
_ZIP = b"PK\x03\x04"


def _color(where: str, value: Any) -> Vec3:
    color = _check.vec3(where, value)
    if not all(0 <= channel <= 1 for channel in color):
        raise SceneError(f"{where} must be within [0, 1] in every channel, got {color}")
    return color


def as_lights(where: str, value: Any) -> Optional[tuple[PointLight, ...]]:
    """None, or a tuple of point lights; one light alone is taken too."""
    if value is None:
        return None
    lights = (value,) if isinstance(value, PointLight) else value
    try:
        lights = tuple(lights)
    except TypeError:
        raise TypeError(f"{where} must be a list of sdfrs.PointLight, got {_check.show(value)}") from None
    for light in lights:
        if not isinstance(light, PointLight):
            raise TypeError(f"{where} must be a list of sdfrs.PointLight, got {_check.show(light)} in it")
    return lights


@dataclass(frozen=True, eq=False)
class Scene:
    """A shape and how to look at it; what a scene file holds.

    Fields: `camera` and `lights` may be None (then fitted when rendered); `background`, plain, and `albedo`,
    each RGB in [0, 1].
    Raises: SceneError and TypeError for anything else.

    Examples:
        >>> import sdfrs
        >>> scene = sdfrs.Scene(sdfrs.sphere(1), camera=sdfrs.Camera.look_at((0, 0, 5)), background=(1, 1, 1))
        >>> scene.background
        (1.0, 1.0, 1.0)
    """

    shape: Shape
    camera: Optional[Camera] = None
    lights: Optional[tuple[PointLight, ...]] = None
    background: Vec3 = (0.93, 0.95, 0.98)
    albedo: Vec3 = (0.8, 0.8, 0.8)

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Shape):
            raise TypeError(f"scene: shape must be a sdfrs.Shape, got {_check.show(self.shape)}")
        as_camera("scene: camera", self.camera)
        put = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        put("lights", as_lights("scene: lights", self.lights))
        put("background", _color("scene: background", self.background))
        put("albedo", _color("scene: albedo", self.albedo))

    def save(self, path: PathLike) -> None:
        """Writes the scene as JSON, whole or not at all.

        Raises: OSError where the file cannot be written (MissingFileError: no such folder).

        Examples:
            >>> import os, tempfile, sdfrs
            >>> path = os.path.join(tempfile.mkdtemp(), "scene.json")
            >>> sdfrs.Scene(sdfrs.sphere(2)).save(path)
            >>> sdfrs.load(path).shape.bounds[1]
            (2.0, 2.0, 2.0)
        """
        text = _core.scene_to_json(self.shape._node, self.camera, self.lights, self.background, self.albedo)
        atomic_write(path, text.encode())


def as_camera(where: str, value: Any) -> Optional[Camera]:
    """None or a camera."""
    if value is not None and not isinstance(value, Camera):
        raise TypeError(f"{where} must be a sdfrs.Camera or None, got {_check.show(value)}")
    return value


def as_scene(what: Any) -> Scene:
    """A scene, or a bare shape wrapped as one."""
    if isinstance(what, Scene):
        return what
    if isinstance(what, Shape):
        return Scene(what)
    raise TypeError(f"a sdfrs.Scene or a sdfrs.Shape is needed, got {_check.show(what)}")


def scene_from_json(text: str) -> Scene:
    """A scene from the text of a file; FormatError names the place of whatever is wrong."""
    parts: tuple[Any, ...] = _core.scene_from_json(text)
    node, camera, lights, background, albedo = parts
    extra: dict[str, Any] = {}
    if background is not None:
        extra["background"] = background
    if albedo is not None:
        extra["albedo"] = albedo
    return Scene(
        Shape._wrap(node),
        None if camera is None else Camera(**camera),
        None if lights is None else tuple(PointLight(*light) for light in lights),
        **extra,
    )


def shape_from_json(text: str) -> Shape:
    """The shape of a scene's text; how shapes are copied and pickled."""
    return scene_from_json(text).shape


@overload
def load(source: SceneName) -> Scene: ...
@overload
def load(source: PathLike) -> Any: ...
def load(source: PathLike) -> Any:
    """A scene from a file, a named example scene (see `sdfrs.scenes`), or a texture from an .npz file.

    Raises: FormatError when the file is neither, with the path of the fault inside it;
    MissingFileError (a FileNotFoundError) when there is neither such a file nor such a name.

    Examples:
        >>> import sdfrs
        >>> scene = sdfrs.load("csg")
        >>> scene.camera.width > 0, len(scene.lights) > 0
        (True, True)
    """
    from . import scenes

    if not isinstance(source, (str, os.PathLike)):
        raise TypeError(f"load takes a path or the name of a scene, got {_check.show(source)}")
    name = os.fspath(source)
    if name in scenes.NAMES and not os.path.exists(name):
        return scenes.NAMES[name]()
    try:
        with open(name, "rb") as file:
            data = file.read(len(_ZIP))
            data += b"" if data == _ZIP else file.read()
    except FileNotFoundError:
        known = ", ".join(scenes.NAMES)
        raise MissingFileError(f"no file {name!r}, and no scene of that name (named scenes: {known})") from None
    if data[:4] == _ZIP:
        from .texture_file import load_npz

        return load_npz(name)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(f"{name}: not UTF-8 text, at byte {error.start}") from None
    try:
        return scene_from_json(text)
    except (FormatError, SceneError) as error:
        raise FormatError(f"{name}: {error}") from None
