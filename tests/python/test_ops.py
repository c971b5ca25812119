"""Every row of the op table by name, through the public surface, against numpy: values, slopes and intervals.

An op that formulas do not name (a whole primitive, a step of a transform) is reached by the shape that lowers to it.
`tests/python/test_house.py` holds that no row is missing here.
"""

import numpy as np
import pytest

import sdfrs

# Enough spheres to be found by place.
CROWD = [tuple(c) for c in np.random.default_rng(3).uniform(-1.0, 1.0, (4200, 3)).tolist()]
CENTRES = [(0.0, 0.0, 0.0), (0.7, 0.1, 0.2), (-0.5, 0.6, -0.3), (0.2, -0.8, 0.4)]


def formula(function):
    return sdfrs.shape(lipschitz=1.0)(function)


def length(*parts):
    return np.sqrt(sum(part * part for part in parts))


def smin(a, b, k):
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def ball(x, y, z, centre=(0, 0, 0), radius=0.5):
    return length(x - centre[0], y - centre[1], z - centre[2]) - radius


def box(x, y, z, half, radius=0.0):
    q = [np.abs(v) - (h - radius) for v, h in zip((x, y, z), half, strict=True)]
    return length(*(np.maximum(v, 0) for v in q)) + np.minimum(np.maximum(np.maximum(*q[:2]), q[2]), 0) - radius


def cylinder(x, y, z, radius, half):
    dx, dy = length(x, z) - radius, np.abs(y) - half
    return np.minimum(np.maximum(dx, dy), 0) + length(np.maximum(dx, 0), np.maximum(dy, 0))


def capsule(x, y, z, a, b, radius):
    p, d = np.stack([x, y, z], axis=1) - np.array(a), np.subtract(b, a)
    along = np.clip(p @ d / (d @ d), 0, 1)
    return np.linalg.norm(p - along[:, None] * d, axis=1) - radius


def cone(x, y, z, r0, r1, half):
    """Distance to the outline, by a ray's three segments."""
    q = length(x, z)
    inside = (np.abs(y) < half) & (q < r0 + (r1 - r0) * (y + half) / (2 * half))
    outline, away = [(0, -half), (r0, -half), (r1, half), (0, half)], np.inf
    for (ax, ay), (bx, by) in zip(outline, outline[1:], strict=False):
        dx, dy = bx - ax, by - ay
        along = np.clip(((q - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0, 1)
        away = np.minimum(away, length(q - ax - along * dx, y - ay - along * dy))
    return np.where(inside, -away, away)


def mandelbulb(x, y, z, n, iterations):
    """iq's estimate, with angles."""
    wx, wy, wz, dr = x.copy(), y.copy(), z.copy(), np.ones_like(x)
    for _ in range(iterations):
        r = length(wx, wy, wz)
        on = r < 2
        theta, phi = n * np.arccos(wy / r), n * np.arctan2(wx, wz)
        dr = np.where(on, n * r ** (n - 1) * dr + 1, dr)
        wx = np.where(on, x + r**n * np.sin(theta) * np.sin(phi), wx)
        wy = np.where(on, y + r**n * np.cos(theta), wy)
        wz = np.where(on, z + r**n * np.sin(theta) * np.cos(phi), wz)
    r = length(wx, wy, wz)
    return 0.5 * np.log(r) * r / dr


def elongated(x, y, z, h):
    q = [v - np.clip(v, -e, e) for v, e in zip((x, y, z), h, strict=True)]
    inside = np.maximum(np.maximum(np.abs(x) - h[0], np.abs(y) - h[1]), np.abs(z) - h[2])
    return ball(*q) + np.minimum(inside, 0)


def twisted(x, y, z, rate):
    c, s = np.cos(rate * y), np.sin(rate * y)
    return ball(c * x - s * z, y, s * x + c * z, (0.4, 0, 0))


def wave(x, y, z):
    return 0.25 * (0.3 * x + 0.2 * y - 0.1 * z + 0.5 * x * y * z)  # slope below 1 in the box, as of a distance


def texture():
    z, y, x = np.meshgrid(*[np.linspace(-2, 2, 9)] * 3, indexing="ij")
    return sdfrs.SdfTexture(wave(x, y, z), bounds=((-2, -2, -2), (2, 2, 2)))


# name: (shape, closed form). A trilinear grid holds `wave` exactly, which is linear along each axis.
TABLE = {
    "const": (formula(lambda p: sdfrs.where(p.x < 0.1, 0.3, p.y)), lambda x, y, z: np.where(x < 0.1, 0.3, y)),
    "add": (formula(lambda p: p.x + p.y), lambda x, y, z: x + y),
    "sub": (formula(lambda p: p.x - p.y), lambda x, y, z: x - y),
    "mul": (formula(lambda p: p.x * p.y), lambda x, y, z: x * y),
    "div": (formula(lambda p: p.x / (p.y + 2)), lambda x, y, z: x / (y + 2)),
    "min": (formula(lambda p: np.minimum(p.x, p.y)), lambda x, y, z: np.minimum(x, y)),
    "max": (formula(lambda p: np.maximum(p.x, p.y)), lambda x, y, z: np.maximum(x, y)),
    "neg": (formula(lambda p: -p.x), lambda x, y, z: -x),
    "abs": (formula(lambda p: abs(p.x)), lambda x, y, z: np.abs(x)),
    "sqrt": (formula(lambda p: np.sqrt(p.x + 2)), lambda x, y, z: np.sqrt(x + 2)),
    "square": (formula(lambda p: np.square(p.x)), lambda x, y, z: x * x),
    "floor": (formula(lambda p: np.floor(3 * p.x)), lambda x, y, z: np.floor(3 * x)),
    "sign": (formula(lambda p: np.sign(p.x)), lambda x, y, z: np.sign(x)),
    "sin": (formula(lambda p: np.sin(5 * p.x)), lambda x, y, z: np.sin(5 * x)),
    "cos": (formula(lambda p: np.cos(5 * p.x)), lambda x, y, z: np.cos(5 * x)),
    "tan": (formula(lambda p: np.tan(p.x)), lambda x, y, z: np.tan(x)),
    "exp": (formula(lambda p: np.exp(p.x)), lambda x, y, z: np.exp(x)),
    "log": (formula(lambda p: np.log(p.x + 2)), lambda x, y, z: np.log(x + 2)),
    "asin": (formula(lambda p: np.arcsin(p.x / 1.2)), lambda x, y, z: np.arcsin(x / 1.2)),
    "acos": (formula(lambda p: np.arccos(p.x / 1.2)), lambda x, y, z: np.arccos(x / 1.2)),
    "atan": (formula(lambda p: np.arctan(p.x)), lambda x, y, z: np.arctan(x)),
    "atan2": (formula(lambda p: np.arctan2(p.x, p.y)), lambda x, y, z: np.arctan2(x, y)),
    "mod": (formula(lambda p: np.remainder(p.x, p.y + 2)), lambda x, y, z: np.mod(x, y + 2)),
    "length2": (formula(lambda p: sdfrs.length(p.x, p.y)), lambda x, y, z: length(x, y)),
    "length3": (formula(sdfrs.length), length),
    "select": (formula(lambda p: sdfrs.where(p.x < p.y, p.z, -p.x)), lambda x, y, z: np.where(x < y, z, -x)),
    "add_const": (formula(lambda p: p.x + 0.3), lambda x, y, z: x + 0.3),
    "sub_const": (formula(lambda p: p.x - 0.3), lambda x, y, z: x - 0.3),
    "mul_const": (formula(lambda p: p.x * 1.7), lambda x, y, z: x * 1.7),
    "div_const": (formula(lambda p: p.x / 1.7), lambda x, y, z: x / 1.7),
    "dot": (sdfrs.plane((0, 3, 4), (0, 1, 0)), lambda x, y, z: 0.6 * (y - 1) + 0.8 * z),
    "smooth_min": (
        sdfrs.sphere(0.5).union(sdfrs.box(0.8), k=0.3),
        lambda x, y, z: smin(ball(x, y, z), box(x, y, z, (0.4, 0.4, 0.4)), 0.3),
    ),
    "smooth_max": (
        sdfrs.sphere(0.5).intersection(sdfrs.box(0.8), k=0.3),
        lambda x, y, z: -smin(-ball(x, y, z), -box(x, y, z, (0.4, 0.4, 0.4)), 0.3),
    ),
    "shell": (sdfrs.sphere(0.5).shell(0.2), lambda x, y, z: np.abs(ball(x, y, z)) - 0.1),
    "elongate": (sdfrs.sphere(0.5).elongate((0.4, 0, 0)), lambda x, y, z: elongated(x, y, z, (0.4, 0, 0))),
    "elongate_inside": (
        sdfrs.sphere(0.5).elongate((0.4, 0.3, 0.2)),
        lambda x, y, z: elongated(x, y, z, (0.4, 0.3, 0.2)),
    ),
    "repeat": (
        sdfrs.sphere(0.2).repeat((0.6, 0, 0)),
        lambda x, y, z: ball(x - 0.6 * np.floor(x / 0.6 + 0.5), y, z, radius=0.2),
    ),
    "rotate_x": (sdfrs.sphere(0.5, center=(0.4, 0, 0)).twist(0.9), lambda x, y, z: twisted(x, y, z, 0.9)),
    "rotate_y": (sdfrs.sphere(0.5, center=(0.4, 0, 0)).twist(-0.9), lambda x, y, z: twisted(x, y, z, -0.9)),
    "sphere": (sdfrs.sphere(0.5, center=(0.7, 0.1, 0.2)), lambda x, y, z: ball(x, y, z, (0.7, 0.1, 0.2))),
    "box": (sdfrs.rounded_box((1, 1.2, 0.8), 0.1), lambda x, y, z: box(x, y, z, (0.5, 0.6, 0.4), 0.1)),
    "torus": (sdfrs.torus(0.7, 0.2), lambda x, y, z: length(length(x, z) - 0.7, y) - 0.2),
    "cylinder": (sdfrs.cylinder(0.5, height=1.2), lambda x, y, z: cylinder(x, y, z, 0.5, 0.6)),
    "capsule": (
        sdfrs.capsule((-0.5, 0.1, 0), (0.4, 0.6, -0.3), 0.2),
        lambda x, y, z: capsule(x, y, z, (-0.5, 0.1, 0), (0.4, 0.6, -0.3), 0.2),
    ),
    "cone": (sdfrs.cone(0.8, 1.2, top_radius=0.2), lambda x, y, z: cone(x, y, z, 0.8, 0.2, 0.6)),
    "ellipsoid": (sdfrs.ellipsoid((1, 0.5, 0.25)), lambda x, y, z: (length(x, y / 0.5, z / 0.25) - 1) * 0.25),
    "gyroid": (
        sdfrs.gyroid(1.1, 0.1),
        lambda x, y, z: (
            np.abs(sum(np.sin(a) * np.cos(b) for a, b in ((x * K, y * K), (y * K, z * K), (z * K, x * K))))
            / (np.sqrt(3) * K)
            - 0.05
        ),
    ),
    "sphere_union": (
        sdfrs.union(*(sdfrs.sphere(0.3, center=c) for c in CENTRES)),
        lambda x, y, z: np.min([ball(x, y, z, c, 0.3) for c in CENTRES], axis=0),
    ),
    "sphere_crowd": (
        sdfrs.union(*(sdfrs.sphere(0.02, center=c) for c in CROWD)),
        lambda x, y, z: np.min([ball(x, y, z, c, 0.02) for c in CROWD], axis=0),
    ),
    "mandelbulb": (sdfrs.mandelbulb(8, 4), lambda x, y, z: mandelbulb(x, y, z, 8, 4)),
    "texture": (texture(), wave),
}
K = 2 * np.pi / 1.1
# The tracers' view of a grid, which no value shows.
TRACED = {"texture_safe": (texture(), 1.0), "texture_safe_negated": (-texture(), -1.0)}


@pytest.fixture
def points(rng):
    return rng.uniform(-1.1, 1.1, (4000, 3))


@pytest.mark.parametrize("name", TABLE)
def test_values(name, points):
    shape, closed = TABLE[name]
    want = closed(*points.T)
    # The Mandelbulb's estimate is chaotic near its surface: there rounding decides.
    loose = 1e6 if name == "mandelbulb" else 1.0
    near = np.abs(want) > 0.02 if name == "mandelbulb" else np.full(len(want), True)
    np.testing.assert_allclose(shape(points, precision="f64")[near], want[near], rtol=0, atol=2e-14 * loose)
    if name not in ("floor", "sign", "const", "select", "mod", "mandelbulb"):  # a jump may fall to the other side
        np.testing.assert_allclose(shape(points), want, rtol=0, atol=4e-6)


@pytest.mark.parametrize("name", TABLE)
def test_slopes(name, points):
    shape, _ = TABLE[name]
    got = shape.gradient(points, precision="f64")
    for axis in range(3):
        wide, narrow = (
            (shape(points + h * np.eye(3)[axis], "f64") - shape(points - h * np.eye(3)[axis], "f64")) / (2 * h)
            for h in (2e-6, 1e-6)
        )
        smooth = np.abs(wide - narrow) < 1e-6 * (1 + np.abs(wide))  # no crease between the samples
        assert smooth.mean() > (0.5 if name == "mandelbulb" else 0.95)
        np.testing.assert_allclose(got[smooth, axis], narrow[smooth], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("name", TABLE)
def test_intervals_hold_every_value(name, rng):
    shape, _ = TABLE[name]
    for _ in range(40):
        lo = rng.uniform(-1.1, 1.0, 3)
        hi = lo + rng.uniform(0.001, 0.4, 3)
        low, high = shape.interval(lo, hi)
        inside = shape(rng.uniform(lo, hi, (200, 3)), "f64")
        assert low <= inside.min() and inside.max() <= high, (name, lo, hi)


@pytest.mark.parametrize("name", TRACED)
def test_grids_are_walked_by_the_safe_step(name, points):
    shape, sign = TRACED[name]
    value = sign * wave(*points.T)
    away = value > 1e-3
    directions = np.tile([0.0, 1.0, 0.0], (away.sum(), 1))
    h = sdfrs.trace(shape, points[away], directions, tracer="basic", max_steps=1, eps=1e-9, precision="f64")
    want = np.maximum(value[away] / np.sqrt(3), value[away] - np.sqrt(3) * 0.5)
    np.testing.assert_allclose(h.distance, want, rtol=0, atol=1e-14)
