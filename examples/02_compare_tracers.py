"""Every tracer on one scene: a table, and their step maps side by side in out/compare_tracers.png.

Usage: 02_compare_tracers.py [scene]; a scene file or a named scene, "csg" by default.
"""

import sys
from pathlib import Path

from PIL import Image, ImageDraw

import sdfrs

TRACERS: list[sdfrs.Tracer] = [
    sdfrs.Basic(),
    sdfrs.Relaxed(omega=1.5),
    sdfrs.Enhanced(),
    sdfrs.AutoRelaxed(),
    sdfrs.BinarySearch(),
    sdfrs.CoverageSearch(),
]


def sheet(maps: list[tuple[str, Image.Image]]) -> Image.Image:
    """The maps in two columns, each under its name."""
    width, height = maps[0][1].size
    page = Image.new("RGB", (2 * width, (height + 16) * ((len(maps) + 1) // 2)), "white")
    pen = ImageDraw.Draw(page)
    for number, (name, picture) in enumerate(maps):
        corner = (number % 2 * width, number // 2 * (height + 16))
        pen.text((corner[0] + 4, corner[1] + 2), name, fill="black")
        page.paste(picture, (corner[0], corner[1] + 16))
    return page


def main() -> None:
    scene = sdfrs.load(sys.argv[1] if len(sys.argv) > 1 else "csg")
    camera = scene.camera.resized(480, 270) if scene.camera else None
    print(f"{'tracer':16} {'hits':>7} {'mean':>7} {'p50':>5} {'p99':>5} {'fallbacks':>10} {'evaluations':>12}")
    maps = []
    vmax = None
    for tracer in TRACERS:
        image = sdfrs.render(scene, camera, tracer=tracer, prune="off")
        s = image.summary
        # One scale for all, so that the maps compare.
        vmax = vmax or float(max(s.p99_steps, 2))
        maps.append((tracer.name, image.heatmap("steps", vmax=vmax)))
        print(
            f"{tracer.name:16} {s.hits:7} {s.mean_steps:7.2f} {s.p50_steps:5.0f} {s.p99_steps:5.0f} "
            f"{s.fallbacks:10} {s.evaluations:12}"
        )
    out = Path(__file__).resolve().parent.parent / "out"
    out.mkdir(exist_ok=True)
    sheet(maps).save(out / "compare_tracers.png")
    print(out / "compare_tracers.png")


if __name__ == "__main__":
    main()
