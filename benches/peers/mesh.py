"""Baking meshes: ours against Open3D's RaycastingScene and pysdf, on one core, in one run.

    python benches/peers/mesh.py FOLDER [--bench PATH] [--resolutions 128 256] [--repeats 3]

FOLDER holds OFF files; bunny00, armadillo and refined_elephant are taken where they are there (Debian's package
libcgal-demo carries them), and an icosphere of 327,680 faces beside them. The venv needs open3d, pysdf, trimesh and
numpy; our bench is built by `cargo build --release --bin mesh` in benches/.

CPU seconds, the least of the repeats, the rivals in turns; from the mesh in memory to all values in memory, so
structures are built anew each time. Peers take points one by one: they are asked for some planes of the grid only, and
their time is building plus the rest in proportion. Our values are compared with Open3D's on these planes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# One core for everything, before a library starts its threads.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"):
    os.environ[variable] = "1"
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import numpy as np
import open3d as o3d
import pysdf
import trimesh

MESHES = ("bunny00", "armadillo", "refined_elephant")
Query = Callable[[Any], Any]


def open3d_query(vertices: Any, faces: Any) -> Query:
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32)))
    return lambda points: scene.compute_signed_distance(o3d.core.Tensor(points), nthreads=1).numpy()


def pysdf_query(vertices: Any, faces: Any) -> Query:
    sdf = pysdf.SDF(vertices.astype(np.float32), faces.astype(np.uint32))
    return lambda points: -sdf(points, n_threads=1)


def planes(lo: list[float], hi: list[float], n: int, count: int) -> tuple[Any, Any]:
    """Nodes of some planes of constant z, and which planes."""
    wanted = max(1, min(n, round(count / (n * n))))
    which = ((np.arange(wanted) + 0.5) * n / wanted).astype(int)
    axes = [np.linspace(lo[k], hi[k], n) for k in range(3)]
    z, y, x = np.meshgrid(axes[2][which], axes[1], axes[0], indexing="ij")
    return np.stack([x, y, z], -1).reshape(-1, 3).astype(np.float32), which


def timed(build: Callable[[Any, Any], Query], mesh: tuple[Any, Any], points: Any, nodes: int) -> tuple[float, Any]:
    """Seconds for all nodes, and the values at the points."""
    start = time.process_time()
    query = build(*mesh)
    query(points[:1])
    built = time.process_time()
    values = query(points)
    return (built - start) + (time.process_time() - built) * nodes / len(points), values


def ours(bench: Path, source: str, n: int, *options: str, isa: str = "") -> dict[str, Any]:
    command = [str(bench), source, str(n), *options]
    out = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, "SDFRS_ISA": isa})
    return dict(json.loads(out.stdout))


def compare(bench: Path, source: str, mesh: tuple[Any, Any], n: int, repeats: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder) / "values"
        report = ours(bench, source, n, "repeats=1", f"raw={raw}")
        lo, hi = report["lo"], report["hi"]
        points, which = planes(lo, hi, n, 100_000)
        values = np.fromfile(raw, "<f4").reshape(n, n, n)[which].ravel()
    many, _ = planes(lo, hi, n, 500_000)
    best = {"ours": float("inf"), "open3d": float("inf"), "pysdf": float("inf"), "avx2": float("inf")}
    theirs = None
    for _ in range(repeats):
        best["ours"] = min(best["ours"], ours(bench, source, n, "repeats=3")["cpu"])
        best["avx2"] = min(best["avx2"], ours(bench, source, n, "repeats=3", isa="avx2")["cpu"])
        seconds, theirs = timed(open3d_query, mesh, points, n**3)
        best["open3d"] = min(best["open3d"], seconds)
        best["pysdf"] = min(best["pysdf"], timed(pysdf_query, mesh, many, n**3)[0])
    side = max(h - l for l, h in zip(lo, hi, strict=True))
    off = np.abs(np.abs(values) - np.abs(theirs))
    signs = int(((values < 0) != (theirs < 0))[np.abs(theirs) > 1e-6 * side].sum())
    return {**best, "faces": report["faces"], "off": float(off.max()) / side, "signs": signs, "nodes": len(points)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    here = Path(__file__).resolve().parent.parent
    parser.add_argument("--bench", type=Path, default=here / "target" / "release" / "mesh")
    parser.add_argument("--resolutions", type=int, nargs="+", default=[128, 256])
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    sources = {name: str(args.folder / f"{name}.off") for name in MESHES if (args.folder / f"{name}.off").exists()}
    sources["icosphere"] = "icosphere:7"
    print("| mesh | faces | grid | ours, s | M nodes/s | Open3D, s | ratio | pysdf, s | ratio | AVX2 / AVX-512 "
          "| largest difference from Open3D, of the box | signs that differ |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    for name, source in sources.items():
        if name == "icosphere":
            tri = trimesh.creation.icosphere(subdivisions=7, radius=1.0)
        else:
            tri = trimesh.load(source, process=False, force="mesh")
        mesh = (np.asarray(tri.vertices), np.asarray(tri.faces))
        for n in args.resolutions:
            r = compare(args.bench, source, mesh, n, args.repeats)
            print(f"| {name} | {r['faces']} | {n}^3 | {r['ours']:.3f} | {n**3 / r['ours'] / 1e6:.1f} | "
                  f"{r['open3d']:.1f} | {r['open3d'] / r['ours']:.0f} | {r['pysdf']:.1f} | {r['pysdf'] / r['ours']:.1f} | "
                  f"{r['avx2'] / r['ours']:.2f} | {r['off']:.1e} | {r['signs']} of {r['nodes']} |", flush=True)
    print("\n| sparse, 4 voxels | bricks and tables, MB | most memory of the process, MB | s |\n|---|---|---|---|")
    for name in ("armadillo", "bunny00"):
        for n in (512, 1024):
            if name in sources:
                r = ours(args.bench, sources[name], n, "sparse", f"repeats={args.repeats}")
                print(f"| {name} {n}^3 | {r['bytes'] / 1e6:.0f} | {r['peak_rss'] / 1e6:.0f} | {r['cpu']:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
