"""The command line: ``sdfrs render | stats | convert | doctor``, in the words of the functions.

Results go to stdout, progress and complaints to stderr; exit codes 0 ok, 1 failed, 2 usage, 130 interrupted.

Examples:
    >>> from sdfrs.cli import main
    >>> main(["stats", "csg", "--size", "16x9", "--tracer", "basic", "--json"])  # doctest: +ELLIPSIS
    {...}
    0
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Optional, Union

from ._errors import Error
from .tracers import TRACERS, Tracer

_SCENE_HELP = (
    "a scene file, a texture (.npz), or a named scene (csg, village, composition, mandelbulb, gyroid, spheres1000, ...)"
)


def parse_tracer(text: str) -> Tracer:
    """A tracer from ``name`` or ``name:parameter=value,...``.

    Examples:
        >>> from sdfrs.cli import parse_tracer
        >>> parse_tracer("relaxed:omega=1.2,form=2018")
        Relaxed(omega=1.2, form='2018', guards=True)
    """
    name, _, rest = text.partition(":")
    if name not in TRACERS:
        raise argparse.ArgumentTypeError(f"unknown tracer {name!r} (choose from {', '.join(TRACERS)})")
    kinds: dict[str, Any] = {"omega": float, "beta": float, "max_level": int, "form": str, "guards": _flag}
    parts: dict[str, Any] = {}
    for item in filter(None, rest.split(",")):
        key, found, value = item.partition("=")
        if not found or key not in TRACERS[name].__dataclass_fields__:  # type: ignore[attr-defined]
            allowed = ", ".join(TRACERS[name].__dataclass_fields__)  # type: ignore[attr-defined]
            raise argparse.ArgumentTypeError(f"{name} takes {allowed} as parameter=value, got {item!r}")
        try:
            parts[key] = kinds[key](value)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{name}: {key} cannot be {value!r}") from None
    try:
        return TRACERS[name](**parts)
    except Error as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _flag(text: str) -> bool:
    try:
        return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
    except KeyError:
        raise ValueError(text) from None


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"a size is WIDTHxHEIGHT, like 1280x720, got {text!r}")
    return int(width), int(height)


def _parser() -> argparse.ArgumentParser:
    from . import __version__

    parser = argparse.ArgumentParser(prog="sdfrs", description="Signed distance functions, sphere traced.")
    parser.add_argument("--version", action="version", version=f"sdfrs {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")

    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("scene", help=_SCENE_HELP)
    common.add_argument("--eps", type=float, default=1e-4, help="hit threshold, world units (default 1e-4)")
    common.add_argument("--cone", type=float, default=0.0, help="pixel radius at unit distance (default 0)")
    common.add_argument("--max-steps", type=int, default=1000, help="evaluations per ray (default 1000)")
    common.add_argument(
        "--t-max", type=float, help="end of the rays, world units (default 100, or behind what the fitted camera sees)"
    )
    common.add_argument("--precision", choices=("f32", "f64"), default="f32")
    common.add_argument("--device", default="auto", help="auto (a real GPU, else the CPU), cpu, gpu or gpu:N")
    common.add_argument(
        "--prune", choices=("auto", "off", "exact", "skip"), default="auto",
        help="on the CPU: shorten programs place by place (auto: exact where rays are measured, skip in pictures)",
    )  # fmt: skip
    common.add_argument("--strict", action="store_true", help="on a GPU: keep every rounding, for the CPU's bits")
    common.add_argument("--size", type=_size, metavar="WxH", help="pixels (default: the scene's camera)")
    common.add_argument("--threads", type=int, help="0: SDFRS_THREADS, else all cores (default)")
    common.add_argument("--json", action="store_true", help="print the numbers as JSON")
    common.add_argument("--quiet", action="store_true", help="no progress on stderr")
    tracer_help = "name, or name:parameter=value,... such as relaxed:omega=1.2,form=2018 (default auto_relaxed)"

    render = commands.add_parser("render", parents=[common], help="render a scene to a picture")
    render.add_argument("-o", "--output", metavar="FILE", help="picture (default: NAME.png)")
    render.add_argument("--tracer", type=parse_tracer, default=TRACERS["auto_relaxed"](), help=tracer_help)
    render.add_argument(
        "--heatmap", action="append", default=[], choices=("steps", "fallbacks", "multiplier", "depth"),
        help="also write this map, to OUTPUT-MAP.png; may be given several times",
    )  # fmt: skip
    stats = commands.add_parser("stats", parents=[common], help="measure tracers on a scene, without shading")
    stats.add_argument(
        "--tracer", type=parse_tracer, action="append", help=f"{tracer_help}; may be given several times"
    )
    _convert_parser(commands.add_parser("convert", help="bake a mesh, or a scene, to a texture of signed distances"))
    doctor = commands.add_parser("doctor", help="versions, threads, instruction set, and what is missing")
    doctor.add_argument("--json", action="store_true", help="print as JSON")
    return parser


def _resolution(text: str) -> Union[int, tuple[int, ...]]:
    parts = text.lower().split("x")
    if len(parts) not in (1, 3) or not all(part.isdecimal() for part in parts):
        raise argparse.ArgumentTypeError(f"a resolution is N or NXxNYxNZ, like 128 or 256x128x128, got {text!r}")
    return int(parts[0]) if len(parts) == 1 else tuple(int(part) for part in parts)


def _convert_parser(convert: argparse.ArgumentParser) -> None:
    """The words of `mesh_to_sdf_texture` and `Shape.to_texture`."""
    convert.add_argument("source", help="a mesh (OBJ, STL, PLY, OFF, GLB), a texture (.npz), a scene file or name")
    convert.add_argument("-o", "--output", metavar="FILE", help=".npz, .raw or .vol (default: NAME.npz)")
    convert.add_argument("--resolution", type=_resolution, default=128, metavar="N", help="nodes: N, or NXxNYxNZ")
    convert.add_argument("--bounds", type=float, nargs=6, metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"))
    convert.add_argument("--padding", type=float, default=0.1, help="on every side, part of the longest edge (0.1)")
    convert.add_argument("--sign", default="auto", help="auto, winding, pseudonormal, parity or unsigned (auto)")
    convert.add_argument("--sparse", action="store_true", help="keep the bricks near the surface alone")
    convert.add_argument("--band", type=float, help="how near, world units (default: 4 cells)")
    convert.add_argument("--dtype", default="float32", help="float32, float16, or uint8 with --sparse")
    convert.add_argument("--confidence", action="store_true", help="how sure each node's sign is, into the file")
    convert.add_argument("--stepping", default="safe", help="safe, bricks or voxel: how tracers will walk it")
    convert.add_argument("--threads", type=int, help="0: SDFRS_THREADS, else all cores (default)")
    convert.add_argument("--json", action="store_true", help="print what was found as JSON")
    convert.add_argument("--quiet", action="store_true", help="no progress on stderr")


def _settings(args: argparse.Namespace) -> dict[str, Any]:
    names = ("eps", "cone", "max_steps", "t_max", "precision", "device", "prune", "strict")
    return {**{name: getattr(args, name) for name in names}, "progress": _progress(args)}


def _progress(args: argparse.Namespace) -> Optional[bool]:
    # tqdm and the plain line both hide from files and pipes that only want the result.
    return True if not args.quiet and sys.stderr.isatty() else None


def _open(args: argparse.Namespace) -> tuple[Any, Any]:
    from .camera import fitted
    from .render import fitted_camera, reach, set_threads
    from .scene import as_scene, load

    if args.threads is not None:
        set_threads(args.threads)
    scene = as_scene(load(args.scene))
    camera = scene.camera
    if args.t_max is None:
        args.t_max = 100.0 if camera is not None else max(100.0, 1.01 * reach(scene.shape, fitted(scene.shape)))
    if args.size is not None:
        camera = fitted_camera(scene.shape, args.t_max, *args.size) if camera is None else camera.resized(*args.size)
    return scene, camera


def _print_json(value: Any) -> None:
    import json

    print(json.dumps(value, indent=2))


def _render(args: argparse.Namespace) -> None:
    from .image import save_pil
    from .render import render

    scene, camera = _open(args)
    output = args.output or os.path.splitext(os.path.basename(args.scene))[0] + ".png"
    image = render(scene, camera, tracer=args.tracer, **_settings(args))
    image.save(output)
    files = {"rgb": output}
    for name in dict.fromkeys(args.heatmap):
        stem, ending = os.path.splitext(output)
        files[name] = f"{stem}-{name}{ending}"
        save_pil(image.heatmap(name), files[name])
    numbers = asdict(image.summary)
    if args.json:
        timings = asdict(image.timings)
        _print_json(
            {"files": files, "tracer": repr(args.tracer), "device": image.device, **timings, "summary": numbers}
        )
        return
    for path in files.values():
        print(path)
    summary, timings_ = image.summary, image.timings
    print(
        f"{summary.hits:,} hits, {summary.mean_steps:.1f} steps per ray (p99 {summary.p99_steps}), "
        f"trace {timings_.trace_seconds:.3f} s, shade {timings_.shade_seconds:.3f} s, {image.device}"
    )


_MESHES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")


def _convert(args: argparse.Namespace) -> None:
    from .mesh import mesh_to_sdf_texture
    from .render import set_threads
    from .scene import as_scene, load
    from .texture import SdfTexture

    if args.threads is not None:
        set_threads(args.threads)
    stem, ending = os.path.splitext(os.path.basename(args.source))
    output = args.output or f"{stem}.npz"
    names = ("resolution", "padding", "sparse", "band", "dtype", "stepping")
    settings: dict[str, Any] = {name: getattr(args, name) for name in names}
    settings["bounds"] = None if args.bounds is None else (args.bounds[:3], args.bounds[3:])
    settings["progress"] = _progress(args)
    if ending.lower() in _MESHES:
        texture = mesh_to_sdf_texture(args.source, sign=args.sign, confidence=args.confidence, **settings)
    else:
        found = load(args.source)
        texture = found if isinstance(found, SdfTexture) else as_scene(found).shape.to_texture(**settings)
    texture.save(output)
    nz, ny, nx = texture.shape_zyx
    report = None if texture.report is None else {**asdict(texture.report), "confidence": None}
    if args.json:
        lo, hi = texture.bounds
        _print_json(
            {"file": output, "dims": [nx, ny, nz], "sparse": texture.sparse, "dtype": str(texture.dtype),
             "bytes": texture.nbytes, "bounds": [lo, hi], "spacing": texture.spacing, "max_error": texture.max_error,
             "lipschitz": texture.lipschitz, "report": report}
        )  # fmt: skip
        return
    print(output)
    kind = "sparse" if texture.sparse else "dense"
    print(
        f"{nx} x {ny} x {nz} nodes, {kind} {texture.dtype}, {texture.nbytes:,} bytes, max error {texture.max_error:.3g}"
    )
    if texture.report is not None:
        print(texture.report)


_COLUMNS = (
    "hits", "misses", "out_of_steps", "mean_steps", "p50_steps", "p99_steps", "fallbacks", "evaluations", "seconds",
)  # fmt: skip


def _stats(args: argparse.Namespace) -> None:
    from .render import trace_stats

    scene, camera = _open(args)
    runs = []
    for tracer in args.tracer or [TRACERS["auto_relaxed"]()]:
        runs.append((tracer, trace_stats(scene, camera, tracer=tracer, **_settings(args))))
    if args.json:
        results = [{"tracer": repr(tracer), "summary": asdict(st.summary)} for tracer, st in runs]
        _print_json({"scene": args.scene, "device": runs[0][1].settings.device, "runs": results})
        return
    rows = [("tracer", *(name.replace("_", " ") for name in _COLUMNS))]
    for tracer, st in runs:
        values = (getattr(st.summary, name) for name in _COLUMNS)
        rows.append((_label(tracer), *(f"{v:.3f}" if isinstance(v, float) else f"{v:,}" for v in values)))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        print("  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:]))]))


def _label(tracer: Tracer) -> str:
    """The name, and whatever differs from the defaults, as --tracer takes it."""
    plain = type(tracer)()
    extra = [f"{k}={v}" for k, v in tracer._parts().items() if v != getattr(plain, k)]
    return tracer.name + (":" + ",".join(extra) if extra else "")


def _doctor(args: argparse.Namespace) -> None:
    from .doctor import examine

    report = examine()
    if args.json:
        _print_json(report)
        return
    for key, value in report.items():
        if key not in ("missing", "devices"):
            print(f"{key:<16} {value}")
    for line in report["devices"]:
        print(f"{'device':<16} {line}")
    for line in report["missing"] or ["nothing"]:
        print(f"{'missing':<16} {line}")


def _say(message: Any, *_: Any, **__: Any) -> None:
    """Warnings as one line, without the place in the source that only programmers want."""
    print(f"sdfrs: warning: {message}", file=sys.stderr)


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs a command; returns the exit code.

    Examples:
        >>> from sdfrs.cli import main
        >>> main(["render"])
        2
    """
    try:
        args = _parser().parse_args(argv)
    except SystemExit as stop:  # argparse has said what was wrong
        return int(stop.code or 0)
    shown, warnings.showwarning = warnings.showwarning, _say
    try:
        {"render": _render, "stats": _stats, "convert": _convert, "doctor": _doctor}[args.command](args)
    except KeyboardInterrupt:
        print("sdfrs: interrupted, nothing half-written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader left; what is still buffered has nowhere to go.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Error, OSError, ImportError, MemoryError) as error:
        print(f"sdfrs: {error or type(error).__name__}", file=sys.stderr)
        return 1
    finally:
        warnings.showwarning = shown
    return 0


if __name__ == "__main__":
    sys.exit(main())
