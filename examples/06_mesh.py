"""A mesh of 56,000 faces as a texture of signed distances, beside the shape it was made from; writes out/mesh.png.

The mesh is the skin of a tube along a torus knot, made here from its formula; the shape is a smooth union of
capsules along the same line. `examples/demo.py` calls `bake_and_draw` too.
"""

import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import sdfrs

RADIUS = 0.17


def knot(angle: np.ndarray, p: int = 2, q: int = 3) -> np.ndarray:
    """Points of a (p, q) torus knot, (N,) -> (N, 3)."""
    reach = 0.75 + 0.28 * np.cos(q * angle)
    return np.stack([reach * np.cos(p * angle), 0.28 * np.sin(q * angle), reach * np.sin(p * angle)], axis=1)


def tube(along: int = 580, around: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of the knot's skin: closed, all faces the same way round."""
    angle = np.linspace(0, 2 * np.pi, along, endpoint=False)
    line = knot(angle)
    ahead = knot(angle + 1e-4) - knot(angle - 1e-4)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    # The knot turns about y, so a frame of the way outwards from there never flips.
    out = line * (1, 0, 1) - ahead * ((line * (1, 0, 1)) * ahead).sum(axis=1, keepdims=True)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    side = np.cross(ahead, out)
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    skin = line[:, None] + RADIUS * (np.cos(turn)[:, None] * out[:, None] + np.sin(turn)[:, None] * side[:, None])
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    a, b = i * around + j, i * around + (j + 1) % around
    c, d = (i + 1) % along * around + (j + 1) % around, (i + 1) % along * around + j
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return skin.reshape(-1, 3), faces


def original(parts: int = 180) -> sdfrs.Shape:
    """The same tube as a formula: capsules from point to point of the knot."""
    line = knot(np.linspace(0, 2 * np.pi, parts, endpoint=False))
    return sdfrs.union(*(sdfrs.capsule(a, b, RADIUS) for a, b in zip(line, np.roll(line, -1, axis=0), strict=True)))


def bake_and_draw(out: Path, size: tuple[int, int] = (480, 360), resolution: int = 256) -> str:
    """Bakes the mesh, draws it beside the original into `out`/mesh.png; returns what there is to say."""
    vertices, faces = tube()
    start = time.perf_counter()
    texture = sdfrs.mesh_to_sdf_texture(vertices, faces, resolution=resolution, stepping="bricks")
    seconds = time.perf_counter() - start
    camera = sdfrs.Camera.look_at((1.5, 2.4, 2.4), (0, -0.05, 0), fov=38, width=size[0], height=size[1])
    shape = original()
    pictures = {f"texture, {resolution} nodes along each axis": texture, "180 capsules": shape}
    images = {label: sdfrs.render(what, camera) for label, what in pictures.items()}
    sheet = Image.new("RGB", (2 * size[0], size[1]))
    for i, (label, image) in enumerate(images.items()):
        sheet.paste(image.to_pil(), (i * size[0], 0))
        ImageDraw.Draw(sheet).text((i * size[0] + 8, 6), label, fill=(40, 40, 40))
    sheet.save(out / "mesh.png")
    baked, formula = (image.depth for image in images.values())
    both = np.isfinite(baked) & np.isfinite(formula)
    off = float(np.median(np.abs(baked[both] - formula[both])))
    return (
        f"{len(faces):,} faces to {resolution}^3 nodes in {seconds:.2f} s "
        f"({resolution**3 / seconds / 1e6:.1f} million nodes a second)\n{texture.report}\n"
        f"max error of a sample {texture.max_error:.2g}, depth beside the original off by {off:.2g} (median)"
    )


if __name__ == "__main__":
    folder = Path(__file__).resolve().parent.parent / "out"
    folder.mkdir(exist_ok=True)
    print(bake_and_draw(folder))
    print(f"wrote {folder / 'mesh.png'}")
