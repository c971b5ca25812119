"""The library against an independent implementation of the same page, ray by ray.

Both get the same grid of values, so that the only freedom left is rounding. `HANDFUL` of the rays may
differ (two correct roundings of a comparison that is a tie in exact arithmetic); they are printed.
"""

import functools

import numpy as np
import pytest

import oracle
import sdfrs

NODES = 33
HALF = 1.2
RAYS = 500  # per grid and reading; ten of these make 5,000 rays for every tracer and form
T_MAX = 8.0
HANDFUL = 0.001
HIT, INVALID = 1, 3
RADII = 1e6


# ---------------------------------------------------------------- fields


def sphere(p):
    return np.linalg.norm(p, axis=-1) - 0.7


def box_at(p, centre, half):
    q = np.abs(p - np.asarray(centre)) - np.asarray(half)
    outside = np.linalg.norm(np.maximum(q, 0.0), axis=-1)
    return outside + np.minimum(q.max(axis=-1), 0.0)


def box(p):
    # The faces lie on grid nodes: walks along an axis meet exact ties.
    return box_at(p, (0, 0, 0), (0.6, 0.45, 0.75))


def boxes(p):
    parts = [
        ((-0.6, 0.1, 0), (0.2, 0.5, 0.3)),
        ((0.5, -0.3, 0.2), (0.35, 0.2, 0.5)),
        ((0.2, 0.6, -0.5), (0.5, 0.1, 0.1)),
    ]
    return np.min([box_at(p, c, h) for c, h in parts], axis=0)


def smooth(p):
    """A sum of plane waves whose slopes add up to at most one."""
    rng = np.random.default_rng(5)
    waves = rng.normal(size=(6, 3)) * 3.0
    phases = rng.uniform(0, 2 * np.pi, 6)
    slopes = np.full(6, 1.0 / 6.0)
    total = np.full(p.shape[:-1], 0.05)
    for k, phase, slope in zip(waves, phases, slopes):
        total = total + slope / np.linalg.norm(k) * np.sin(p @ k + phase)
    return total


def plate(p):
    return np.abs(p[..., 2] - 0.013) - 0.01


FIELDS = {f.__name__: f for f in (sphere, box, boxes, smooth, plate)}


@functools.cache
def grid(name):
    axis = np.linspace(-HALF, HALF, NODES)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return FIELDS[name](np.stack([x, y, z], axis=-1))


@functools.cache
def both(name, raw):
    """(the library's shape, the oracle's grid) over the same values."""
    bounds = ((-HALF,) * 3, (HALF,) * 3)
    shape = sdfrs.SdfTexture(grid(name), bounds=bounds)
    if raw:
        shape = shape.with_lipschitz(1.0)
    return shape, oracle.Grid(grid(name), *bounds, raw=raw)


# ---------------------------------------------------------------- rays


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@functools.cache
def rays(seed, count=RAYS):
    """A fifth each: aimed at the middle, past the shape, grazing a face, along an axis, from inside."""
    rng = np.random.default_rng(seed)
    n = count // 5
    away = unit(rng.normal(size=(n, 3))) * rng.uniform(1.3, 3.0, (n, 1))
    aimed = away, unit(rng.uniform(-0.5, 0.5, (n, 3)) - away)
    past = away, unit(rng.normal(size=(n, 3)) * 0.8 - away)
    level = np.stack([np.full(n, -1.5), rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)], -1)
    grazing = level, unit(np.stack([np.ones(n), rng.uniform(-0.05, 0.05, n), rng.uniform(-0.05, 0.05, n)], -1))
    along = axis_rays(rng, n)
    inside = rng.uniform(-0.5, 0.5, (n, 3)), unit(rng.normal(size=(n, 3)))
    parts = [aimed, past, grazing, along, inside]
    return np.concatenate([o for o, _ in parts]), np.concatenate([d for _, d in parts])


def axis_rays(rng, n):
    """Exact directions, half of them through nodes of the grid."""
    axis = rng.integers(0, 3, n)
    sign = rng.choice([-1.0, 1.0], n)
    o = rng.uniform(-1.1, 1.1, (n, 3))
    nodes = np.linspace(-HALF, HALF, NODES)
    o[::2] = nodes[rng.integers(1, NODES - 1, (len(o[::2]), 3))]
    d = np.zeros((n, 3))
    o[np.arange(n), axis] = -2.0 * sign
    d[np.arange(n), axis] = sign
    return o, d


# ---------------------------------------------------------------- comparison

WALKERS = oracle.walkers()


def label(key):
    tracer, form, guards = key
    return "-".join([tracer, *([form] if form else []), "guarded" if guards else "letter"])


def library_tracer(key):
    name, form, guards = key
    classes = {
        "basic": sdfrs.Basic,
        "relaxed": sdfrs.Relaxed,
        "enhanced": sdfrs.Enhanced,
        "auto_relaxed": sdfrs.AutoRelaxed,
        "binary_search": sdfrs.BinarySearch,
        "coverage_search": sdfrs.CoverageSearch,
    }
    return classes[name](guards=guards, **({"form": form} if form else {}))


def singular(key, outcome):
    """The printed ratio divided by rounding noise: the ray leaves a face at a right angle and steps a million radii.

    From there on the last bit of every sample decides the walk, so that there is nothing to compare; the
    field itself is a number everywhere, and only a step to infinity is invalid.
    """
    return not key[2] and (outcome.status == INVALID or abs(outcome.multiplier) > RADII)


def differences(key, name, raw, o, d, walker=None, **settings):
    """Lines naming each ray on which the two disagree."""
    shape, field = both(name, raw)
    settings = dict(t_max=T_MAX, eps=1e-4, max_steps=400) | settings
    got = sdfrs.trace(shape, o, d, tracer=library_tracer(key), precision="f64", **settings)
    want = oracle.trace(field.sample, o, d, walker or WALKERS[key], **settings)
    searching = key[0] in ("binary_search", "coverage_search")
    lines = []
    for i, w in enumerate(want):
        counts = int(got.status[i]), int(got.steps[i]), int(got.fallbacks[i])
        same = counts == (w.status, w.steps, w.fallbacks)
        if same and w.status == HIT:
            slack = max(settings["eps"], settings.get("cone", 0.0) * w.t) if searching else 0.0
            same = abs(got.t[i] - w.t) <= slack + 1e-12 * max(1.0, abs(w.t))
        if same and not searching:
            same = abs(got.multiplier[i] - w.multiplier) <= 1e-6 * max(1.0, abs(w.multiplier))
        if not same and not singular(key, w):
            lines.append(
                f"{label(key)} {name}{' raw' if raw else ''} ray {i} o={o[i].tolist()} d={d[i].tolist()}: "
                f"library status, steps, fallbacks {counts} t {got.t[i]!r} x{got.multiplier[i]:.6g}; "
                f"oracle {(w.status, w.steps, w.fallbacks)} t {w.t!r} x{w.multiplier:.6g}{' crossing' if w.crossing else ''}"
            )
    return lines


@pytest.mark.parametrize("key", WALKERS, ids=label)
def test_ray_by_ray(key):
    lines, total = [], 0
    for seed, name in enumerate(FIELDS):
        for raw in (False, True):
            o, d = rays(seed)
            lines += differences(key, name, raw, o, d)
            total += len(o)
    print("\n".join(lines))
    assert total >= 4000
    assert len(lines) <= HANDFUL * total


@pytest.mark.parametrize("key", WALKERS, ids=label)
@pytest.mark.parametrize("name", ["boxes", "smooth"])
def test_settings(key, name):
    """A small budget, thresholds that grow with t, and intervals of each ray's own."""
    o, d = rays(9, 250)
    rng = np.random.default_rng(10)
    t_min = rng.uniform(0.0, 1.0, len(o))
    lines = []
    for settings in (
        {"max_steps": 1},
        {"max_steps": 6},
        {"cone": 5e-3},
        {"eps": 1e-2},
        {"t_min": t_min, "t_max": t_min + rng.uniform(0.5, 3.0, len(o))},
    ):
        for raw in (False, True):
            lines += differences(key, name, raw, o, d, **settings)
    print("\n".join(lines))
    assert len(lines) <= HANDFUL * 10 * len(o)


def test_the_comparison_can_fail():
    """Another relaxation than the library's must show."""
    o, d = rays(1)
    key = ("relaxed", "2023", True)
    other = oracle.walkers(omega=1.4)[key]
    assert len(differences(key, "box", False, o, d, walker=other)) > len(o) / 4
