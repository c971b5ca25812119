"""What several test files use: shapes of every kind, random points, a small camera."""

import signal

import numpy as np
import pytest

import sdfrs

# A shell that starts a job in the background has it ignore Ctrl-C, and so would every process that a test starts.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def every_shape():
    """One shape of each op, by name; unbounded ones and expressions among them."""
    ball, cube = sdfrs.sphere(1.0), sdfrs.box((1.0, 1.5, 2.0))
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, 17)] * 3, indexing="ij")
    grid = sdfrs.SdfTexture((np.sqrt(x * x + y * y + z * z) - 0.6).astype(np.float32), ((-1, -1, -1), (1, 1, 1)))
    formula = sdfrs.shape(lipschitz=1.7)(lambda p: sdfrs.length(p) - 1.0 + 0.05 * np.sin(12.0 * p.x))
    return {
        "sphere": ball,
        "box": cube,
        "rounded_box": sdfrs.rounded_box((1, 1.5, 2), 0.2),
        "torus": sdfrs.torus(1.0, 0.25),
        "cylinder": sdfrs.cylinder(0.5, height=2),
        "capsule": sdfrs.capsule((0, 0, 0), (1, 1, 0.5), 0.3),
        "cone": sdfrs.cone(0.8, 1.5, top_radius=0.2),
        "ellipsoid": sdfrs.ellipsoid((1.0, 0.5, 0.3)),
        "plane": sdfrs.plane((0.3, 1, 0.2), (0, 0.1, 0)),
        "gyroid": sdfrs.gyroid(0.8, 0.1),
        "mandelbulb": sdfrs.mandelbulb(8, 4),
        "texture": grid,
        "union": ball | cube.translate((1, 0, 0)),
        "smooth_union": ball.union(cube.translate((1, 0, 0)), sdfrs.torus(1.5, 0.2), k=0.3),
        "intersection": ball & cube,
        "smooth_intersection": ball.intersection(cube, k=0.2),
        "difference": ball - cube,
        "smooth_difference": ball.difference(cube, k=0.2),
        "negate": -ball,
        "dilate": cube.dilate(0.2),
        "erode": cube.erode(0.2),
        "shell": ball.shell(0.2),
        "displace": ball.displace(lambda p: 0.1 * np.sin(4 * p.y)),
        "with_lipschitz": ball.with_lipschitz(2.0),
        "with_bounds": sdfrs.plane().with_bounds((-1, -1, -1), (1, 0, 1)),
        "translate": cube.translate((0.5, -0.25, 1)),
        "rotate": cube.rotate(0.7, axis=(1, 2, 3)),
        "scale": ball.scale((1.0, 2.0, 0.5)),
        "mirror": sdfrs.sphere(0.5, center=(1, 0, 0)).mirror("x"),
        "repeat": sdfrs.sphere(0.4, center=(0.3, 0, 0)).repeat((1.2, 0, 1.5), (3, 0, 2)),
        "elongate": ball.elongate((0.5, 0, 1)),
        "twist": cube.twist(0.6),
        "bend": cube.bend(0.3),
        "formula": formula,
    }


@pytest.fixture(scope="session")
def shapes():
    return every_shape()


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.fixture
def camera():
    return sdfrs.Camera.look_at((3, 2, 4), (0, 0, 0), width=48, height=36)
