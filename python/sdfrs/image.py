"""A rendered picture with everything known about its pixels."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Optional

import numpy as np

from . import _check
from ._errors import SceneError
from ._files import PathLike, atomic_write
from .results import HIT, Settings, Summary, Timings, table

if TYPE_CHECKING:
    import numpy.typing as npt
    from PIL.Image import Image as PilImage

MapName = Literal["steps", "fallbacks", "multiplier", "depth"]
MAPS = ("steps", "fallbacks", "multiplier", "depth")


@dataclass(frozen=True, eq=False, repr=False)
class Image:
    """A picture: `render` makes it; row 0 is the top.

    Fields: `rgb` (H, W, 3) uint8; `depth` (H, W), world units along the ray, inf on a miss; `normals` (H, W, 3);
    `status`, `steps`, `fallbacks`, `multiplier` (H, W); `summary`; `device`, which and why; `settings`; `timings`.

    Examples:
        >>> import sdfrs
        >>> img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=32, height=24))
        >>> img
        <sdfrs.Image 32x24, auto_relaxed>
    """

    rgb: npt.NDArray[np.uint8]
    depth: npt.NDArray[Any]
    normals: npt.NDArray[np.float32]
    status: npt.NDArray[np.uint8]
    steps: npt.NDArray[np.uint32]
    fallbacks: npt.NDArray[np.uint32]
    multiplier: npt.NDArray[Any]
    summary: Summary
    device: str
    settings: Settings
    timings: Timings

    def __repr__(self) -> str:
        height, width = self.status.shape
        return f"<sdfrs.Image {width}x{height}, {self.settings.tracer.name}>"

    @property
    def hit(self) -> npt.NDArray[np.bool_]:
        """Where a surface was hit, (H, W) bool.

        Examples:
            >>> import sdfrs
            >>> img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=9, height=9))
            >>> bool(img.hit[4, 4]), bool(img.hit[0, 0])
            (True, False)
        """
        return self.status == HIT

    def to_pil(self) -> PilImage:
        """The picture as a Pillow image, mode RGB.

        Examples:
            >>> import sdfrs
            >>> sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=9, height=8)).to_pil().size
            (9, 8)
        """
        from PIL import Image as pil

        return pil.fromarray(np.ascontiguousarray(self.rgb))

    def save(self, path: PathLike) -> None:
        """Writes the picture, whole or not at all; the ending of the name says the format.

        Raises: SceneError for an ending Pillow does not know; OSError where the file cannot be written.

        Examples:
            >>> import os, tempfile, sdfrs
            >>> path = os.path.join(tempfile.mkdtemp(), "a.png")
            >>> sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=9, height=8)).save(path)
            >>> os.path.getsize(path) > 0
            True
        """
        save_pil(self.to_pil(), path)

    def heatmap(self, what: MapName = "steps", *, vmax: Optional[float] = None) -> PilImage:
        """A map of the pixels in colours, with a colour bar, as a Pillow image.

        Args: `what` is "steps", "fallbacks", "multiplier" or "depth"; `vmax` ends the scale (None: nearly the
        largest value; whatever lies beyond gets the last colour).
        Raises: SceneError for any other name, or a vmax that is not above the start of the scale.

        Examples:
            >>> import sdfrs
            >>> img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=160, height=120))
            >>> img.heatmap("steps", vmax=32).width >= 160
            True
        """
        from .plot import heatmap

        name = _check.choice("heatmap: what", what, MAPS)
        return heatmap(getattr(self, name), name, None if vmax is None else _check.number("heatmap: vmax", vmax))

    def _repr_png_(self) -> bytes:
        return encode(self.to_pil(), "PNG")

    def _repr_html_(self) -> str:
        import base64

        data = base64.b64encode(self._repr_png_()).decode()
        height, width = self.status.shape
        s = self.summary
        rows = [
            ("tracer", repr(self.settings.tracer)),
            ("size", f"{width} x {height}"),
            ("hits", f"{s.hits:,}"),
            ("steps per ray", f"{s.mean_steps:.1f} (p99 {s.p99_steps:.0f})"),
            ("seconds", f"{self.timings.trace_seconds:.3f} trace, {self.timings.shade_seconds:.3f} shade"),
            ("device", self.device),
        ]
        return f'<img alt="rendered picture" src="data:image/png;base64,{data}"/>{table(rows)}'


def encode(picture: PilImage, kind: str) -> bytes:
    """A Pillow image as the bytes of a file."""
    out = io.BytesIO()
    picture.save(out, format=kind)
    return out.getvalue()


def save_pil(picture: PilImage, path: PathLike) -> None:
    """Writes a Pillow image through a temporary file."""
    from PIL import Image as pil

    pil.init()
    ending = os.path.splitext(os.fspath(path))[1].lower()
    kind = pil.EXTENSION.get(ending)
    if kind is None or kind not in pil.SAVE:
        raise SceneError(f"save: the name must end in a picture format such as .png, got {os.fspath(path)!r}")
    atomic_write(path, encode(picture, kind))
