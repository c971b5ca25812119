"""A numpy grid as a shape, inside a CSG like any other; writes out/texture.png.

The grid holds a torus knot's distance, sampled every 1/30: what a mesh converter or a simulation would hand
over.
"""

from pathlib import Path

import numpy as np

import sdfrs


def knot(points: np.ndarray, p: int = 2, q: int = 3, radius: float = 0.16) -> np.ndarray:
    """Distance from (N, 3) points to a (p, q) torus knot's tube: to the nearest of many points of its middle line."""
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    reach = 0.75 + 0.28 * np.cos(q * angle)
    line = np.stack([reach * np.cos(p * angle), 0.28 * np.sin(q * angle), reach * np.sin(p * angle)], axis=1)
    nearest = np.full(len(points), np.inf)
    for point in line:
        np.minimum(nearest, ((points - point) ** 2).sum(axis=1), out=nearest)
    return np.sqrt(nearest) - radius


lo, hi = (-1.3, -0.6, -1.3), (1.3, 0.6, 1.3)
nx, ny, nz = 79, 37, 79
z, y, x = np.meshgrid(
    np.linspace(lo[2], hi[2], nz), np.linspace(lo[1], hi[1], ny), np.linspace(lo[0], hi[0], nx), indexing="ij"
)
values = knot(np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(nz, ny, nx).astype(np.float32)

tied = sdfrs.SdfTexture(values, bounds=(lo, hi))
shape = (tied - sdfrs.box((1, 2, 1)).translate((0.8, 0, 0.8))).union(sdfrs.sphere(0.35), k=0.1)
camera = sdfrs.Camera.look_at(origin=(1.6, 2.6, 2.6), target=(0, 0, 0), fov=38, width=960, height=540)
image = sdfrs.render(shape, camera)
out = Path(__file__).resolve().parent.parent / "out"
out.mkdir(exist_ok=True)
image.save(out / "texture.png")
print(f"{out / 'texture.png'}: bound {shape.lipschitz:.3g}, {image.summary.mean_steps:.1f} steps per ray")
