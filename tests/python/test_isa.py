"""The same bits on every instruction set: SDFRS_ISA caps what a process uses."""

import os
import subprocess
import sys

import pytest

WORK = """
import hashlib, sys
import numpy as np
import sdfrs

out = hashlib.sha256()

def take(*arrays):
    for array in arrays:
        out.update(np.ascontiguousarray(array).tobytes())

for name in ("csg", "composition", "thin_shell", "mandelbulb"):
    scene = sdfrs.load(name)
    camera = scene.camera.resized(150, 90)
    for precision in ("f32", "f64"):
        for tracer in ("basic", "relaxed", "enhanced", "auto_relaxed"):
            for prune in ("off", "exact", "skip"):
                s = sdfrs.trace_stats(scene, camera, tracer=tracer, precision=precision, prune=prune)
                take(s.depth, s.status, s.steps, s.fallbacks, s.multiplier, s.flags, s.summary.witness)
        image = sdfrs.render(scene, camera, precision=precision)
        take(image.rgb, image.depth, image.normals)
        hits = sdfrs.trace(scene.shape, *camera.rays(), precision=precision)
        take(hits.t, hits.distance, hits.witness)
texture = sdfrs.torus(1.0, 0.3).to_texture(40)
take(texture.values)
print(out.hexdigest())
"""


def bits(isa: str) -> str:
    env = {**os.environ, "SDFRS_ISA": isa}
    done = subprocess.run([sys.executable, "-c", WORK], env=env, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.fixture(scope="module")
def best() -> str:
    return bits("")


@pytest.mark.parametrize("isa", ["baseline", "sse4.1", "avx2"])
def test_traces_and_pictures_have_the_same_bits(isa: str, best: str) -> None:
    # A name that no processor has leaves the best one in use.
    assert len(best) == 64 and bits(isa) == best
