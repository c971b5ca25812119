"""`Shape.check`: a random search for a pair of points that breaks the declared bound.

Pairs are drawn at all scales, then the steepest ones are climbed; a slope beyond
the bound by more than rounding is a proof that the bound is wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _check

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Vec3
    from .shapes import Shape


@dataclass(frozen=True)
class LipschitzCheck:
    """What `Shape.check` found: the steepest pair of points it came across.

    Fields: `ok`; `bound` declared; `observed` slope |f(a) - f(b)|/|a - b|; the points `a` and `b`.

    Examples:
        >>> import sdfrs
        >>> found = sdfrs.sphere(1).with_lipschitz(0.5).check(samples=500)
        >>> found.ok, found.bound, round(found.observed, 3)
        (False, 0.5, 1.0)
        >>> len(found.a), len(found.b)
        (3, 3)
    """

    ok: bool
    bound: float
    observed: float
    a: Vec3
    b: Vec3

    def __repr__(self) -> str:
        verdict = "ok" if self.ok else "VIOLATED"
        a, b = ("({:.6g}, {:.6g}, {:.6g})".format(*p) for p in (self.a, self.b))
        return f"LipschitzCheck({verdict}: declared {self.bound:g}, observed {self.observed:.6g} between {a} and {b})"


def _slopes(shape: Shape, a: npt.NDArray[Any], b: npt.NDArray[Any]) -> npt.NDArray[Any]:
    gap = np.sqrt(((a - b) ** 2).sum(axis=1))
    fa, fb = shape(a, precision="f64"), shape(b, precision="f64")
    # Rounding of values of this size must not pass for steepness.
    noise = 64 * np.finfo(np.float64).eps * (np.abs(fa) + np.abs(fb) + np.abs(a).max(axis=1) + 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (np.abs(fa - fb) - noise) / gap
    return np.where(np.isfinite(slope) & (gap > 0), slope, 0.0)


def check_lipschitz(shape: Shape, samples: int, seed: int) -> LipschitzCheck:
    """Draws pairs about the surface and in the bounds, then climbs from the steepest."""
    samples = _check.integer("check: samples", samples, 1, 100_000_000)
    rng = np.random.default_rng(_check.integer("check: seed", seed, 0, 2**63 - 1))
    lo, hi = (np.array(corner) for corner in shape.bounds)
    lo, hi = np.where(np.isfinite(lo), lo, -4.0), np.where(np.isfinite(hi), hi, 4.0)
    hi = np.maximum(hi, lo + 1e-6)
    size = float(np.linalg.norm(hi - lo))
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    a = middle + 1.5 * half * rng.uniform(-1, 1, (samples, 3))
    values = shape(a, precision="f64")
    slope = shape.gradient(a, precision="f64")
    # Half of the points are pulled to the surface, where most edges and creases are.
    near = rng.random(samples) < 0.5
    step = -(values / np.maximum((slope**2).sum(axis=1), 1e-12))[:, None] * slope
    a = np.where((near & np.isfinite(step).all(axis=1))[:, None], a + np.clip(step, -size, size), a)
    towards = rng.normal(size=(samples, 3))
    # Pairs along the slope find more than pairs along nowhere.
    along = (rng.random(samples) < 0.5) & np.isfinite(slope).all(axis=1) & ((slope**2).sum(axis=1) > 0)
    towards = np.where(along[:, None], slope, towards)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True) + 1e-300
    gap = size * 10.0 ** rng.uniform(-5, 0, (samples, 1))
    b = a + gap * towards

    best_a, best_b, best = a[0], b[0], -math.inf
    for _ in range(12):
        found = _slopes(shape, a, b)
        top = np.argsort(found)[-max(1, min(64, samples)) :]
        if found[top[-1]] > best:
            best, best_a, best_b = float(found[top[-1]]), a[top[-1]], b[top[-1]]
        # Climb: jitter the steepest pairs by fractions of their own size, keep the seeds.
        seeds = np.repeat(top, 8)
        gap = np.linalg.norm(b[seeds] - a[seeds], axis=1, keepdims=True)
        shift = rng.normal(size=(seeds.size, 3)) * gap * rng.choice([0.0, 0.1, 1.0, 10.0], (seeds.size, 1))
        turn = rng.normal(size=(seeds.size, 3)) * gap * rng.choice([0.0, 0.02, 0.2], (seeds.size, 1))
        a, b = a[seeds] + shift, b[seeds] + shift + turn
    bound = shape.lipschitz
    to_vec = lambda v: (float(v[0]), float(v[1]), float(v[2]))  # noqa: E731
    return LipschitzCheck(best <= bound * (1 + 1e-9), bound, max(best, 0.0), to_vec(best_a), to_vec(best_b))
