"""Named example scenes: each function returns a `Scene` with a camera and lights.

``sdfrs.load("csg")`` and the command line know them by name.

Examples:
    >>> import sdfrs
    >>> sorted(sdfrs.scenes.NAMES)[:3]
    ['composition', 'csg', 'grazing_plane']
"""

from __future__ import annotations

import math
from collections.abc import Callable

from .camera import Camera, PointLight
from .primitives import (
    box,
    capsule,
    cone,
    cylinder,
    ellipsoid,
    intersection,
    plane,
    rounded_box,
    sphere,
    torus,
    union,
)
from .primitives import (
    gyroid as gyroid_shape,
)
from .primitives import (
    mandelbulb as mandelbulb_shape,
)
from .scene import Scene
from .shapes import Axis, Shape

_SKY = (0.78, 0.86, 0.95)


def csg() -> Scene:
    """A drilled rounded cube on a plinth among four columns: a dozen primitives.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.csg().shape.lipschitz
        1.0
    """
    bore = cylinder(0.5, height=4)
    cube = sphere(1.0) & box((1.5, 1.5, 1.5))
    cube -= bore | bore.orient((1, 0, 0)) | bore.orient((0, 0, 1))
    columns = cylinder(0.14, height=2.2).translate((1.5, -0.1, 1.5)).union(sphere(0.24, center=(1.5, 1.1, 1.5)), k=0.1)
    plinth = rounded_box((2.0, 0.3, 2.0), 0.06, center=(0, -1.05, 0)) | torus(1.15, 0.08, center=(0, -1.1, 0))
    ground = plane(point=(0, -1.2, 0))
    scene = union(cube.rotate(0.5, axis=(0, 1, 0)), columns.mirror("x").mirror("z"), plinth, ground)
    camera = Camera.look_at((1.5, 2.3, 5.4), (0, -0.15, 0), fov=37, width=1280, height=720)
    lights = (PointLight((7, 6, 3), (1.0, 0.95, 0.85), 0.95), PointLight((-7, 4, 6), (0.55, 0.7, 1.0), 0.25))
    return Scene(scene, camera, lights, _SKY, (0.86, 0.80, 0.72))


def _house(width: float, height: float, depth: float, pitch: float, ridge_along: str = "z") -> Shape:
    """Planar walls under a gable, eaves that overhang, a door, windows and a chimney.

    Even in x and z, so that repeating it costs one copy; built along either axis for the same reason.
    """
    side: Axis = "x" if ridge_along == "z" else "z"
    front: Axis = "z" if ridge_along == "z" else "x"

    def at(x: float, y: float, z: float) -> tuple[float, float, float]:
        return (x, y, z) if ridge_along == "z" else (z, y, x)

    rise, run = math.sin(pitch), math.cos(pitch)
    ridge = height + width / 2 * math.tan(pitch)
    walls = box(at(width, 2 * ridge, depth)) & plane(at(rise, run, 0), (0, ridge, 0)).mirror(side)
    # The panes lie a little behind the walls, on opposite sides at once.
    panes = box(at(0.22, 0.3, 2 * depth), center=at(width / 4, 0.62 * height, 0)).mirror(side)
    side_panes = box(at(2 * width, 0.3, 0.26), center=at(0, 0.62 * height, depth / 4)).mirror(front)
    door = box(at(0.26, 1.3 * height, 2 * depth))
    openings = (panes | side_panes | door) - box(at(width - 0.1, 2 * height, depth - 0.1))
    thick, over = 0.07, 0.16
    roof = intersection(
        plane(at(rise, run, 0), (0, ridge + thick, 0)).mirror(side),
        plane(at(-rise, -run, 0), (0, ridge, 0)).mirror(side),
        box(at(width + 2 * over, 4 * ridge, depth + 2 * over)),
        plane((0, -1, 0), (0, height - 0.2, 0)),
    )
    chimney = box(at(0.2, 0.5, 0.24), center=(0, ridge + 0.12, 0))
    return (walls - openings) | roof | chimney


def village() -> Scene:
    """Several hundred planar houses by repetition about a church on a square.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.village().shape.lipschitz
        1.0
    """
    cottage = _house(1.3, 0.9, 1.7, 0.75)
    manor = _house(1.5, 1.3, 1.3, 0.6, ridge_along="x")
    barn = _house(1.7, 0.8, 2.3, 0.5)
    # One quarter of the village, folded over both axes: 4*(49 + 49) houses and 2*5 barns.
    quarter = union(
        cottage.repeat((5.2, 0, 5.2), (3, 0, 3)).translate((19.6, 0, 19.6)),
        manor.repeat((5.2, 0, 5.2), (3, 0, 3)).translate((22.2, 0, 22.2)),
        barn.repeat((5.2, 0, 0), (2, 0, 0)).translate((19.6, 0, 0)),
    )
    houses = quarter.mirror("x").mirror("z")
    ground = plane()
    scene = union(houses, _church(), ground)
    camera = Camera.look_at((17.0, 13.0, 30.0), (1.5, 0.5, 2.0), fov=42, width=1280, height=720)
    lights = (PointLight((140, 85, 10), (1.0, 0.90, 0.74), 1.0), PointLight((-80, 60, 90), (0.5, 0.68, 1.0), 0.3))
    return Scene(scene, camera, lights, _SKY, (0.80, 0.72, 0.62))


def _church() -> Shape:
    nave = _house(2.4, 2.2, 5.0, 0.85).translate((0, 0, -0.8))
    tower = box((1.8, 10.0, 1.8))
    spire = union(
        intersection(
            plane((3, 1, 0), (0, 9.6, 0)).mirror("x"),
            plane((0, 1, 3), (0, 9.6, 0)).mirror("z"),
            box((2.2, 9.6, 2.2), center=(0, 9.6, 0)),
        )
    )
    belfry = box((0.5, 1.1, 4.0), center=(0, 4.1, 0)) | box((4.0, 1.1, 0.5), center=(0, 4.1, 0))
    return nave | ((tower - belfry) | spire).translate((0, 0, 2.4))


def composition() -> Scene:
    """A still life of a few dozen primitives with smooth blends on a ground plane.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.composition().camera.width
        1280
    """
    parts = [_pot(), _snail(), _arch(), _chess(), _flower(), _blocks()]
    scene = union(plane(), *parts)
    camera = Camera.look_at((2.2, 3.4, 8.2), (0, 0.95, 0), fov=36, width=1280, height=720)
    lights = (PointLight((6, 10, 7), (1.0, 0.95, 0.86), 0.95), PointLight((-8, 5, 5), (0.55, 0.7, 1.0), 0.35))
    return Scene(scene, camera, lights, (0.86, 0.88, 0.92), (0.85, 0.79, 0.74))


def _pot() -> Shape:
    """A teapot: belly, spout, handle, lid."""
    belly = ellipsoid((0.85, 0.7, 0.85), center=(0, 0.72, 0)).union(torus(0.5, 0.1, center=(0, 0.1, 0)), k=0.15)
    spout = capsule((0.6, 0.6, 0), (1.25, 1.15, 0), 0.11).union(torus(0.1, 0.04).translate((1.3, 1.2, 0)), k=0.08)
    handle = torus(0.38, 0.075).rotate(math.pi / 2, axis=(1, 0, 0)).translate((-0.85, 0.8, 0))
    lid = ellipsoid((0.45, 0.14, 0.45), center=(0, 1.36, 0)).union(sphere(0.11, center=(0, 1.56, 0)), k=0.08)
    pot = belly.union(spout, handle, k=0.14)
    return (pot | torus(0.45, 0.045, center=(0, 1.31, 0)) | lid).rotate(0.5).translate((-0.2, 0, 0.1))


def _snail() -> Shape:
    """A snail of capsules and rings."""
    foot = capsule((-0.5, 0.1, 0), (0.45, 0.1, 0), 0.1).union(capsule((0.45, 0.1, 0), (0.62, 0.38, 0), 0.1), k=0.12)
    horns = capsule((0.62, 0.4, 0.03), (0.72, 0.66, 0.12), 0.028).union(sphere(0.05, center=(0.72, 0.67, 0.12)), k=0.02)
    house = torus(0.22, 0.14).union(torus(0.1, 0.1, center=(0, 0.1, 0)), sphere(0.1, center=(0, 0.2, 0)), k=0.06)
    house = house.rotate(math.pi / 2, axis=(1, 0, 0)).translate((-0.08, 0.44, 0))
    return foot.union(horns.mirror("z"), house, k=0.05).rotate(-0.7).translate((1.9, 0, 2.0))


def _arch() -> Shape:
    """An arch of two columns and half a ring, with a twisted pillar beside it."""
    half = torus(1.0, 0.17).rotate(math.pi / 2, axis=(1, 0, 0)) & plane((0, -1, 0))
    column = cylinder(0.17, height=1.5, center=(1.0, -0.75, 0)).union(
        rounded_box((0.55, 0.16, 0.55), 0.04, center=(1.0, -1.42, 0)), k=0.1
    )
    arch = half.union(column.mirror("x"), k=0.05).translate((0, 1.5, 0)).rotate(-0.35).translate((2.2, 0, -1.6))
    pillar = rounded_box((0.46, 2.4, 0.46), 0.05).twist(1.1).translate((0, 1.2, 0))
    pillar |= rounded_box((0.8, 0.2, 0.8), 0.05, center=(0, 0.1, 0)) | sphere(0.3, center=(0, 2.6, 0))
    return arch | pillar.translate((-2.6, 0, -1.5))


def _chess() -> Shape:
    """A pawn and a bishop."""
    pawn = cone(0.34, 0.9, top_radius=0.1, center=(0, 0.45, 0)).union(sphere(0.2, center=(0, 1.02, 0)), k=0.06)
    pawn = pawn.union(cylinder(0.38, height=0.16, center=(0, 0.08, 0)), torus(0.17, 0.045, center=(0, 0.82, 0)), k=0.08)
    bishop = cone(0.36, 1.2, top_radius=0.11, center=(0, 0.6, 0)).union(
        ellipsoid((0.2, 0.3, 0.2), center=(0, 1.42, 0)), k=0.08
    )
    bishop -= box((0.5, 0.05, 0.5)).rotate(0.7, axis=(0, 0, 1)).translate((0.16, 1.52, 0))
    bishop = bishop.union(
        cylinder(0.4, height=0.18, center=(0, 0.09, 0)), torus(0.19, 0.05, center=(0, 1.12, 0)), k=0.08
    )
    return pawn.translate((-1.75, 0, 1.5)) | (bishop | sphere(0.07, center=(0, 1.76, 0))).translate((-2.35, 0, 0.5))


def _flower() -> Shape:
    """Six petals about a heart, by folding, over a bent stalk."""
    petal = ellipsoid((0.24, 0.05, 0.11), center=(0.34, 0.0, 0))
    ring = union(*(petal.rotate(math.pi / 3 * i) for i in range(6)), k=0.05)
    head = ring.union(sphere(0.15), k=0.06).rotate(0.9, axis=(1, 0, 0.3)).translate((0.05, 1.05, 0.1))
    stalk = capsule((0, 0, -0.05), (0.05, 1.05, 0.06), 0.04)
    return head.union(stalk, k=0.05).translate((0.85, 0, 2.1))


def _blocks() -> Shape:
    """Toy blocks: shell of a ball, ring, wedge, beads in a row."""
    ball = sphere(0.4, center=(0, 0.4, 0)).shell(0.06) - box((0.5, 0.5, 0.5), center=(0.3, 0.6, 0.35))
    beads = (
        sphere(0.11, center=(0, 0.11, 0))
        .union(torus(0.12, 0.035, center=(0, 0.11, 0)), k=0.04)
        .repeat((0.34, 0, 0), (3, 0, 0))
    )
    cube = rounded_box((0.62, 0.62, 0.62), 0.06, center=(0, 0.31, 0)).difference(
        cylinder(0.2, height=1.0).translate((0, 0.3, 0)), k=0.06
    )
    return union(
        ball.translate((3.0, 0, 0.5)),
        beads.rotate(0.35).translate((-0.55, 0, 2.6)),
        cube.rotate(0.6).translate((1.7, 0, -0.1)),
    )


def mandelbulb() -> Scene:
    """The Mandelbulb of power 8, half a percent thicker: its own surface has no normals to shade.

    The estimate rises faster than a distance here and there; three times the slope covers what was seen.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.mandelbulb().shape.bounds[1][0] > 1
        True
    """
    bulb = mandelbulb_shape(8, 8).with_lipschitz(3.0).dilate(0.005)
    camera = Camera.look_at((1.45, 1.3, 1.9), (0, -0.03, 0), fov=49, width=1280, height=720)
    lights = (PointLight((-3.5, 4, 2), (1.0, 0.88, 0.70), 1.0), PointLight((5, 0, 1), (0.35, 0.55, 1.0), 0.4))
    return Scene(bulb, camera, lights, (0.07, 0.08, 0.11), (0.92, 0.74, 0.56))


def gyroid() -> Scene:
    """A gyroid cut to a ball.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.gyroid().shape.bounds[0]
        (-1.0, -1.0, -1.0)
    """
    camera = Camera.look_at((1.9, 1.4, 2.4), (0, 0, 0), fov=40, width=1280, height=720)
    lights = (PointLight((4, 6, 3), (1.0, 0.95, 0.88), 0.95), PointLight((-5, 2, 4), (0.6, 0.75, 1.0), 0.3))
    return Scene(gyroid_shape(0.55, 0.06) & sphere(1.0), camera, lights, (0.95, 0.95, 0.97), (0.62, 0.78, 0.80))


def spheres1000() -> Scene:
    """A thousand spheres at random, the same thousand everywhere.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.spheres1000().shape.lipschitz
        1.0
    """
    state = 1

    def uniform() -> float:
        nonlocal state
        # Knuth's MMIX constants; the upper bits are the good ones.
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (state >> 11) / 2**53

    balls = []
    for _ in range(1000):
        center = tuple(4.0 * uniform() - 2.0 for _ in range(3))
        balls.append(sphere(0.04 + 0.1 * uniform(), center=center))
    camera = Camera.look_at((4.7, 3.4, 6.3), (0, 0, 0), fov=40, width=1280, height=720)
    lights = (PointLight((6, 9, 5), (1.0, 0.96, 0.9), 0.95), PointLight((-7, 3, 5), (0.6, 0.75, 1.0), 0.3))
    return Scene(union(*balls), camera, lights, (0.94, 0.95, 0.97), (0.85, 0.62, 0.50))


def grazing_plane() -> Scene:
    """A plane seen almost along itself: the hard case of sphere tracing.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.grazing_plane().shape([[0, 1, 0]])
        array([1.], dtype=float32)
    """
    camera = Camera.look_at((0, 0.25, 0), (0, 0.15, -10), fov=50, width=1280, height=720)
    return Scene(plane(), camera, (PointLight((3, 6, -4)),), _SKY, (0.7, 0.74, 0.62))


def thin_shell() -> Scene:
    """An open ball, its wall a thousandth of its radius thick: what over-relaxed steps jump through.

    Examples:
        >>> import sdfrs
        >>> float(sdfrs.scenes.thin_shell().shape([[-1, 0, 0]])[0]) < 0
        True
    """
    wall = sphere(1.0).shell(0.001) - box((1.4, 1.4, 1.4), center=(0.5, 0.7, 0.7))
    camera = Camera.look_at((2.2, 1.6, 2.8), (0, 0, 0), fov=42, width=1280, height=720)
    lights = (PointLight((4, 6, 5)), PointLight((-4, 1, 4), (0.6, 0.75, 1.0), 0.3))
    return Scene(wall, camera, lights, (0.95, 0.95, 0.97), (0.80, 0.72, 0.62))


def near_miss() -> Scene:
    """Rays that pass a row of rods by less and less before they reach a wall.

    Examples:
        >>> import sdfrs
        >>> sdfrs.scenes.near_miss().camera.kind
        'pinhole'
    """
    rods = [capsule((0.35 * i - 2.1, -2, 0), (0.35 * i - 2.1, 2, 0), 0.172 - 0.006 * i) for i in range(13)]
    camera = Camera.look_at((0.5, 0.6, 4.5), (0, 0, 0), fov=42, width=1280, height=720)
    lights = (PointLight((3, 5, 6)), PointLight((-4, 1, 4), (0.6, 0.75, 1.0), 0.3))
    return Scene(union(*rods, plane((0, 0, 1), (0, 0, -1.5))), camera, lights, (0.95, 0.95, 0.97), (0.75, 0.78, 0.84))


NAMES: dict[str, Callable[[], Scene]] = {
    scene.__name__: scene
    for scene in (
        csg, village, composition, mandelbulb, gyroid, spheres1000, grazing_plane, thin_shell, near_miss,
    )
}  # fmt: skip
