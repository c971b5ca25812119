"""What tracing returns: arrays per ray, maps per pixel, and the numbers of a run."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._check import Precision, Prune, Vec3
    from .camera import Camera, PointLight
    from .tracers import Tracer

MISS, HIT, OUT_OF_STEPS, INVALID = range(4)


def active_rays(steps: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """Rays still active after n steps, for n = 0 up to the largest count."""
    if steps.size == 0:
        return np.zeros(1, dtype=np.int64)
    return (steps.size - np.cumsum(np.bincount(steps.reshape(-1)))).astype(np.int64)


@dataclass(frozen=True)
class Settings:
    """Everything that made a picture or a measurement.

    Examples:
        >>> import sdfrs
        >>> img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=8), tracer="basic")
        >>> img.settings.tracer, img.settings.eps
        (Basic(guards=True), 0.0001)
    """

    tracer: Tracer
    eps: float
    cone: float
    max_steps: int
    t_max: float
    precision: Precision
    device: str
    threads: int
    camera: Camera
    lights: Optional[tuple[PointLight, ...]]
    background: Optional[Vec3]
    albedo: Optional[Vec3]
    version: str
    prune: Prune


@dataclass(frozen=True)
class Timings:
    """Seconds of the two halves of a render.

    On the CPU surfaces are shaded as they are found: the wall clock is divided as the workers' time was.

    Examples:
        >>> import sdfrs
        >>> img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=8))
        >>> img.timings.trace_seconds >= 0 and img.timings.shade_seconds >= 0
        True
    """

    trace_seconds: float
    shade_seconds: float


@dataclass(frozen=True)
class Summary:
    """The numbers of one run: how rays ended, what they cost, what was noticed.

    Fields: rays by status; `crossings`: safe steps that jumped the surface; `precision_limited`: hits that
    rounding decided, not eps; `inside`: rays that started in the solid; steps per ray (mean, p50, p99, max);
    `fallbacks`, `evaluations` of the field (the sum of the steps) and `node_evaluations` (operations times points as they were
    run, of programs and of the probes that shortened them; the first sample of all rays of a pinhole camera is run once,
    and a union of 4,096 spheres or more that is found by place counts as 256) in total; `prune`, what pruning was in use;
    `mean_ops`, `p50_ops`, `p99_ops`, operations of the program an evaluation ran; `arena_bytes`, what the pruner kept in
    memory; `seconds`; `witness`,
    the steepest slope seen along a ray over the declared bound, and `lipschitz_observed`, the same in the
    shape's own units.

    Examples:
        >>> import sdfrs
        >>> s = sdfrs.trace_stats(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=8)).summary
        >>> s.hits + s.misses + s.out_of_steps + s.invalid
        64
    """

    rays: int
    hits: int
    misses: int
    out_of_steps: int
    invalid: int
    crossings: int
    precision_limited: int
    inside: int
    mean_steps: float
    p50_steps: int
    p99_steps: int
    max_steps: int
    fallbacks: int
    evaluations: int
    node_evaluations: int
    prune: str
    mean_ops: float
    p50_ops: int
    p99_ops: int
    arena_bytes: int
    seconds: float
    witness: float
    lipschitz_observed: float


@dataclass(frozen=True, eq=False, repr=False)
class Hits:
    """What became of each ray: arrays of length N, in the order of the rays.

    Fields: `t`, world units along the ray, inf on a miss; `status` (uint8: 0 miss, 1 hit, 2 out of steps,
    3 invalid); `steps` and `fallbacks` (uint32); `multiplier`, mean step over radius; `distance`, the last
    value; `witness`, largest slope seen; `flags` (uint8: 1 started inside, 2 crossing, 4 decided by rounding);
    `device`, which and why.

    Examples:
        >>> import sdfrs
        >>> h = sdfrs.trace(sdfrs.sphere(1), [[0, 0, 3]], [[0, 0, -1]])
        >>> h.status.tolist(), round(float(h.t[0]), 3)
        ([1], 2.0)
        >>> int(h.active_rays[0])
        1
    """

    t: npt.NDArray[Any]
    status: npt.NDArray[np.uint8]
    steps: npt.NDArray[np.uint32]
    fallbacks: npt.NDArray[np.uint32]
    multiplier: npt.NDArray[Any]
    distance: npt.NDArray[Any]
    witness: npt.NDArray[Any]
    flags: npt.NDArray[np.uint8]
    summary: Summary
    device: str

    @property
    def hit(self) -> npt.NDArray[np.bool_]:
        """Where a surface was hit, (N,) bool.

        Examples:
            >>> import sdfrs
            >>> sdfrs.trace(sdfrs.sphere(1), [[0, 0, 3]], [[0, 0, 1]]).hit
            array([False])
        """
        return self.status == HIT

    @property
    def active_rays(self) -> npt.NDArray[np.int64]:
        """Rays still active after n steps, (largest count + 1,).

        Examples:
            >>> import sdfrs
            >>> h = sdfrs.trace(sdfrs.sphere(1), [[0, 0, 3]], [[0, 0, -1]], tracer="basic")
            >>> h.active_rays
            array([1, 1, 0])
        """
        return active_rays(self.steps)

    def __repr__(self) -> str:
        s = self.summary
        return f"<sdfrs.Hits {self.t.size} rays, {s.hits} hits, {s.mean_steps:.1f} steps per ray>"


@dataclass(frozen=True, eq=False, repr=False)
class Stats:
    """Maps (H, W) and numbers of one run over a camera's rays; `trace_stats` makes it.

    Fields: `status`, `steps`, `fallbacks`, `multiplier`, `depth` (inf on a miss), `flags`; `summary`; `settings`.

    Examples:
        >>> import sdfrs
        >>> st = sdfrs.trace_stats(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=6), tracer="relaxed")
        >>> st.steps.shape, st.summary.evaluations == int(st.steps.sum())
        ((6, 8), True)
    """

    status: npt.NDArray[np.uint8]
    steps: npt.NDArray[np.uint32]
    fallbacks: npt.NDArray[np.uint32]
    multiplier: npt.NDArray[Any]
    depth: npt.NDArray[Any]
    flags: npt.NDArray[np.uint8]
    summary: Summary
    settings: Settings

    @property
    def active_rays(self) -> npt.NDArray[np.int64]:
        """Rays still active after n steps, (largest count + 1,).

        Examples:
            >>> import sdfrs
            >>> st = sdfrs.trace_stats(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=6))
            >>> int(st.active_rays[0]), int(st.active_rays[-1])
            (48, 0)
        """
        return active_rays(self.steps)

    def __repr__(self) -> str:
        h, w = self.status.shape
        s = self.summary
        return f"<sdfrs.Stats {w}x{h}, {s.hits} hits, {s.mean_steps:.1f} steps per ray, {s.seconds:.3f} s>"

    def _repr_html_(self) -> str:
        rows = [("tracer", repr(self.settings.tracer))]
        rows += [(field.name.replace("_", " "), _text(getattr(self.summary, field.name))) for field in fields(Summary)]
        return table(rows)


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.4g}" if isinstance(value, float) else f"{value:,}"


def table(rows: list[tuple[str, str]]) -> str:
    """Two columns of text as HTML."""
    import html

    cells = "".join(
        f"<tr><th style='text-align:left'>{html.escape(a)}</th><td>{html.escape(b)}</td></tr>" for a, b in rows
    )
    return f"<table>{cells}</table>"
