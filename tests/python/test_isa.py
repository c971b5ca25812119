"""The same bits on every instruction set: SDFRS_ISA caps what a process uses. A name that is none is said."""

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


@pytest.mark.parametrize(
    "name, value, said",
    [
        ("SDFRS_ISA", "sse41", True),
        ("SDFRS_ISA", "sse4.1", False),
        ("SDFRS_ISA", "", False),
        ("SDFRS_THREADS", "two", True),
        ("SDFRS_THREADS", "0", False),
        ("SDFRS_THREADS", "2", False),
    ],
)
def test_a_setting_that_names_nothing_is_said(name: str, value: str, said: bool) -> None:
    env = {**os.environ, name: value}
    run = [sys.executable, "-c", "import sdfrs; print(sdfrs.sphere(1.0)([[0.0, 0.0, 3.0]]))"]
    done = subprocess.run(run, env=env, capture_output=True, text=True, check=True)
    assert (f"RuntimeWarning: {name}: got {value!r}, which is ignored, allowed: " in done.stderr) == said
    assert "2." in done.stdout
