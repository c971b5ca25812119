"""The README's picture: a village of 402 houses, and what each pixel cost two of the tracers."""

from pathlib import Path

from PIL import Image

import sdfrs

OUT = Path(__file__).resolve().parent.parent / "out"
OUT.mkdir(exist_ok=True)

village = sdfrs.load("village")
assert village.camera is not None
picture = sdfrs.render(village, village.camera.resized(960, 540)).to_pil()
maps = [
    sdfrs.render(village, village.camera.resized(480, 270), tracer=name, prune="off").heatmap("steps", vmax=90)
    for name in ("basic", "auto_relaxed")
]
sheet = Image.new("RGB", (960, 540 + maps[0].height), "white")
sheet.paste(picture, (0, 0))
for i, steps in enumerate(maps):
    sheet.paste(steps, (480 * i, 540))
sheet.save(OUT / "overview.png", optimize=True)
print(f"wrote {OUT / 'overview.png'}")
