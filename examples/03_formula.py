"""A formula as a shape, and what its Lipschitz bound is for; writes out/formula.png.

A ripple of amplitude 0.05 and frequency 12 can change by 1 + 0.05 * 12 = 1.6 in one unit of length. A tracer that
believes less takes steps that jump through the crests; `check` looks for a pair of points that proves it.
"""

from pathlib import Path

import numpy as np

import sdfrs


@sdfrs.shape(lipschitz=1.6)
def ripple(p):  # type: ignore[no-untyped-def]
    return sdfrs.length(p) - 1.0 + 0.05 * np.sin(12.0 * p.x) * np.cos(12.0 * p.z)


shape = ripple - sdfrs.box((2, 2, 2)).translate((1, 1, 1))
print(f"bound {shape.lipschitz:g}, box {shape.bounds}")
print("declared 1.6:", ripple.check(samples=20_000))
print("declared 1.0:", ripple.with_lipschitz(1.0).check(samples=20_000))

camera = sdfrs.Camera.look_at(origin=(2.5, 2, 3), target=(0, 0, 0), fov=35, width=960, height=540)
image = sdfrs.render(shape, camera)
out = Path(__file__).resolve().parent.parent / "out"
out.mkdir(exist_ok=True)
image.save(out / "formula.png")
print(out / "formula.png")
