"""Renders two scene files by every tracer, with maps of what each pixel cost, and prints one table; bakes a mesh, too.

`python3 dev.py demo` runs this. The pictures and table.csv land in out/demo; `--quick` draws them small.
"""

import argparse
import csv
import runpy
import sys
import time
from pathlib import Path

import sdfrs

HERE = Path(__file__).resolve().parent
OUT = HERE.parent / "out" / "demo"
SCENES = ("village", "composition")
# With guards the two years' forms are one walk, so the older ones are shown to the letter.
TRACERS: dict[str, sdfrs.Tracer] = {
    "basic": sdfrs.Basic(),
    "relaxed 1.2": sdfrs.Relaxed(omega=1.2),
    "relaxed 1.5": sdfrs.Relaxed(omega=1.5),
    "relaxed 1.5 2018 letter": sdfrs.Relaxed(omega=1.5, form="2018", guards=False),
    "enhanced .88": sdfrs.Enhanced(omega=0.88),
    "enhanced .88 2018 letter": sdfrs.Enhanced(omega=0.88, form="2018", guards=False),
    "auto_relaxed .3": sdfrs.AutoRelaxed(beta=0.3),
    "binary_search stackless": sdfrs.BinarySearch(form="stackless"),
    "binary_search stack": sdfrs.BinarySearch(form="stack"),
    "binary_search split": sdfrs.BinarySearch(form="split"),
    "coverage_search": sdfrs.CoverageSearch(),
}
COLUMNS = (
    "scene", "tracer", "hits", "misses", "out of steps", "mean", "p50", "p99", "fallbacks", "evaluations", "seconds",
)  # fmt: skip


def draw(scene: sdfrs.Scene, camera: sdfrs.Camera, name: str, label: str, vmax: float | None) -> sdfrs.Image:
    """One picture and its three maps, as files."""
    # Unpruned, on the CPU: the table compares what the tracers themselves do.
    image = sdfrs.render(scene, camera, tracer=TRACERS[label], prune="off", device="cpu")
    stem = f"{name}_{label.replace(' ', '_')}"
    # Level 1 writes files a fifth larger in a third of the time: 88 of them are written.
    image.to_pil().save(OUT / f"{stem}.png", compress_level=1)
    # One scale for all tracers of a scene, so that their maps compare at a glance.
    image.heatmap("steps", vmax=vmax).save(OUT / f"{stem}_steps.png", compress_level=1)
    image.heatmap("fallbacks").save(OUT / f"{stem}_fallbacks.png", compress_level=1)
    image.heatmap("multiplier").save(OUT / f"{stem}_multiplier.png", compress_level=1)
    return image


def row(name: str, label: str, image: sdfrs.Image) -> list[str]:
    s = image.summary
    return [
        name, label, str(s.hits), str(s.misses), str(s.out_of_steps), f"{s.mean_steps:.2f}", f"{s.p50_steps:.0f}",
        f"{s.p99_steps:.0f}", str(s.fallbacks), str(s.evaluations), f"{image.timings.trace_seconds:.3f}",
    ]  # fmt: skip


def show(rows: list[list[str]]) -> None:
    """The rows under their names, words to the left, numbers to the right."""
    widths = [max(len(line[i]) for line in [list(COLUMNS), *rows]) for i in range(len(COLUMNS))]
    for number, line in enumerate([list(COLUMNS), ["-" * width for width in widths], *rows]):
        if number > 2 and line[0] != rows[number - 3][0]:
            print()
        cells = [c.ljust(w) if i < 2 else c.rjust(w) for i, (c, w) in enumerate(zip(line, widths, strict=True))]
        print("  ".join(cells).rstrip())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true", help="320x180 instead of 1280x720")
    size = (320, 180) if parser.parse_args().quick else (1280, 720)
    OUT.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    rows: list[list[str]] = []
    for name in SCENES:
        scene = sdfrs.load(HERE / f"{name}.json")
        if scene.camera is None:
            sys.exit(f"demo: examples/{name}.json has no camera")
        vmax = None
        for label in TRACERS:
            image = draw(scene, scene.camera.resized(*size), name, label, vmax)
            vmax = vmax or float(max(image.summary.p99_steps, 2))
            rows.append(row(name, label, image))
            done = f"[{len(rows)}/{len(SCENES) * len(TRACERS)}] {name}, {label}"
            print(f"{done}: {image.timings.trace_seconds:.2f} s", file=sys.stderr, flush=True)
    with open(OUT / "table.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([list(COLUMNS), *rows])
    print(f"{size[0]}x{size[1]}, mean / p50 / p99 are steps per ray, seconds are of tracing alone; {image.device}\n")
    show(rows)
    mesh = runpy.run_path(str(HERE / "06_mesh.py"))["bake_and_draw"]
    print(f"\n{mesh(OUT, (240, 180) if size[0] < 640 else (640, 480))}")
    print(f"\n{4 * len(rows) + 1} pictures and table.csv in {OUT}, {time.perf_counter() - start:.0f} s in all")


if __name__ == "__main__":
    main()
