"""Heat maps: values per pixel in colours, with a colour bar that says what they mean."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from ._errors import SceneError

if TYPE_CHECKING:
    import numpy.typing as npt
    from PIL.Image import Image as PilImage

# Dark to light through one turn of hue: orders survive in grey and for most colour-blind eyes.
_STOPS = np.array(
    [
        (68, 1, 84), (72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142),
        (31, 158, 137), (53, 183, 121), (110, 206, 88), (181, 222, 43), (253, 231, 37),
    ],
    dtype=np.float64,
)  # fmt: skip
_NOTHING = (32, 32, 36)
_LABELS = {
    "steps": "steps (evaluations per ray)",
    "fallbacks": "fallbacks per ray",
    "multiplier": "mean step / radius",
    "depth": "depth (world units)",
}


def colors(unit: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Values in [0, 1] as RGB; whatever is not finite gets a dark grey."""
    position = np.clip(np.nan_to_num(unit, nan=0.0, posinf=0.0, neginf=0.0), 0.0, 1.0) * (len(_STOPS) - 1)
    below = np.minimum(position.astype(np.intp), len(_STOPS) - 2)
    part = (position - below)[..., None]
    mixed = _STOPS[below] * (1 - part) + _STOPS[below + 1] * part
    mixed[~np.isfinite(unit)] = _NOTHING
    return (mixed + 0.5).astype(np.uint8)


def _scale(values: npt.NDArray[Any], what: str, vmax: Optional[float]) -> tuple[float, float, bool]:
    """Start and end of the scale, and whether values lie beyond its end."""
    finite = values[np.isfinite(values)]
    low = {"steps": 0.0, "fallbacks": 0.0, "multiplier": 1.0}.get(what)
    if low is None:
        low = float(finite.min()) if finite.size else 0.0
    top = float(finite.max()) if finite.size else low + 1.0
    if vmax is not None:
        if not vmax > low:
            raise SceneError(f"heatmap: vmax must be > {low:g}, the start of the scale, got {vmax:g}")
        return low, vmax, top > vmax
    # A handful of extreme pixels must not turn the rest of the map dark.
    high = float(np.percentile(finite, 99.5)) if finite.size else top
    high = top if top <= 1.5 * high else high
    if what in ("steps", "fallbacks"):
        high = float(np.ceil(high))
    return (low, high, top > high) if high > low else (low, low + 1.0, False)


def _number(value: float) -> str:
    return f"{value:.0f}" if value == int(value) else f"{value:.3g}"


def heatmap(values: npt.NDArray[Any], what: str, vmax: Optional[float] = None) -> PilImage:
    """The map with a colour bar under it: numbers at the ends, what it shows in the middle."""
    from PIL import Image as pil
    from PIL import ImageDraw, ImageFont

    data = values.astype(np.float64)
    low, high, beyond = _scale(data, what, vmax)
    height, width = data.shape
    size = int(np.clip(width // 50, 11, 28))
    try:
        font: Any = ImageFont.load_default(size=size)
    except (TypeError, ImportError):  # a Pillow without FreeType has one small font
        font = ImageFont.load_default()
    pad, bar = size // 2 + 2, size
    page = max(width, 14 * size)
    canvas = pil.new("RGB", (page, height + 3 * pad + bar + size), (255, 255, 255))
    canvas.paste(pil.fromarray(colors((data - low) / (high - low))), ((page - width) // 2, 0))
    ramp = np.broadcast_to(np.linspace(0, 1, page - 2 * pad), (bar, page - 2 * pad))
    canvas.paste(pil.fromarray(colors(ramp)), (pad, height + pad))
    draw = ImageDraw.Draw(canvas)
    line = height + pad + bar + pad // 2
    draw.text((pad, line), _number(low), fill=(0, 0, 0), font=font)
    end = (">= " if beyond else "") + _number(high)
    draw.text((page - pad - draw.textlength(end, font=font), line), end, fill=(0, 0, 0), font=font)
    label = _LABELS[what]
    room = page - 2 * pad - draw.textlength(end + _number(low) + "    ", font=font)
    if draw.textlength(label, font=font) > room:
        label = what
    draw.text(((page - draw.textlength(label, font=font)) / 2, line), label, fill=(0, 0, 0), font=font)
    return canvas
