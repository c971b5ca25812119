"""How much memory sparse textures take: bytes of the bricks, most of the process beyond the imported package, seconds.

    python benches/peers/sparse.py MESH [RESOLUTION]

in a venv with sdfrs, on Linux. Each row is a process of its own with one thread: the Python call for each kind of
storage, then the command line, whose seconds include the start of Python and the writing of the file.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CALL = """
import json, sys, time, numpy, sdfrs

def held(name):
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024

before, start, cpu = held("VmRSS:"), time.perf_counter(), time.process_time()
texture = sdfrs.mesh_to_sdf_texture(sys.argv[1], resolution=int(sys.argv[2]), sparse=True, dtype=sys.argv[3])
wall, cpu = time.perf_counter() - start, time.process_time() - cpu
print(json.dumps([texture.nbytes, held("VmHWM:") - before, cpu, wall, texture.max_error]))
"""
IMPORT = "import sdfrs, sdfrs.cli, sdfrs.texture_file, numpy; print(next(l.split()[1] for l in open('/proc/self/status') if l.startswith('VmRSS:')))"


def run(command: list[str]) -> tuple[str, int, float]:
    """What a command printed, the most memory it held, and its processor's seconds."""
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "SDFRS_THREADS": "1"})
    assert child.stdout is not None
    text = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        raise SystemExit(f"{command[:3]} failed with {status}")
    return text, usage.ru_maxrss * 1024, usage.ru_utime + usage.ru_stime


def main(mesh: str, resolution: str = "1024") -> None:
    base = int(run([sys.executable, "-c", IMPORT])[0]) * 1024
    print(
        "| dtype | call | texture, MB | most memory beyond the import, MB | CPU s | max_error |\n|---|---|---|---|---|---|"
    )
    for dtype in ("float32", "float16", "uint8"):
        rows = [json.loads(run([sys.executable, "-c", CALL, mesh, resolution, dtype])[0]) for _ in range(3)]
        nbytes, peak, cpu, _, error = (min(column) for column in zip(*rows))
        print(f"| {dtype} | Python | {nbytes / 1e6:.1f} | {peak / 1e6:.1f} | {cpu:.2f} | {error:.1e} |", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            out = str(Path(folder) / "out.npz")
            command = [
                sys.executable,
                "-m",
                "sdfrs",
                "convert",
                mesh,
                "-o",
                out,
                "--resolution",
                resolution,
                "--sparse",
            ]
            start = time.perf_counter()
            _, most, cpu = run([*command, "--dtype", dtype, "--quiet"])
            size = os.path.getsize(out)
            wall = time.perf_counter() - start
        print(
            f"| | `sdfrs convert` | {size / 1e6:.1f} (file) | {(most - base) / 1e6:.1f} | {cpu:.2f} ({wall:.1f} wall) | |",
            flush=True,
        )


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main(*sys.argv[1:3])
