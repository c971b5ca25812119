"""Every tracer by name, and the driver that feeds all rays from one look-up per round."""

import numpy as np

from . import letter, search, steppers
from .common import Outcome, Ray

__all__ = ["Outcome", "trace", "walkers"]


def walkers(omega=1.5, enhanced_omega=0.88, beta=0.3, max_level=18):
    """{(tracer, form or None, guards): ray -> generator}, everything that can be asked for."""
    relaxed = lambda ray: steppers.guarded(ray, steppers.relaxed(omega), first=omega)
    enhanced = lambda ray: steppers.guarded(ray, steppers.enhanced(enhanced_omega))
    return {
        ("basic", None, True): lambda ray: steppers.guarded(ray, steppers.plain),
        ("basic", None, False): letter.basic,
        ("relaxed", "2023", True): relaxed,
        ("relaxed", "2018", True): relaxed,
        ("relaxed", "2023", False): lambda ray: letter.relaxed_2023(ray, omega),
        ("relaxed", "2018", False): lambda ray: letter.relaxed_2018(ray, omega),
        ("enhanced", "2023", True): enhanced,
        ("enhanced", "2018", True): enhanced,
        ("enhanced", "2023", False): lambda ray: letter.enhanced_2023(ray, enhanced_omega),
        ("enhanced", "2018", False): lambda ray: letter.enhanced_2018(ray, enhanced_omega),
        ("auto_relaxed", None, True): lambda ray: steppers.guarded(ray, steppers.auto_relaxed, beta=beta),
        ("auto_relaxed", None, False): lambda ray: letter.auto_relaxed(ray, beta),
        ("binary_search", "stackless", True): search.stackless,
        ("binary_search", "stackless", False): lambda ray: search.stackless_letter(ray, max_level),
        ("binary_search", "stack", True): search.stack,
        ("binary_search", "stack", False): search.stack_letter,
        ("binary_search", "split", True): search.split,
        ("binary_search", "split", False): search.split_letter,
        ("coverage_search", None, True): search.coverage,
    }


def trace(sample, origins, directions, walker, *, eps=1e-4, cone=0.0, t_min=0.0, t_max=100.0, max_steps=1000):
    """Walk every ray; `sample((N, 3)) -> (N,)` is the field, `walker` one of `walkers()`. A list of Outcome."""
    origins = np.asarray(origins, dtype=np.float64)
    directions = np.asarray(directions, dtype=np.float64)
    x, y, z = directions.T
    directions = directions / np.sqrt(x * x + y * y + z * z)[:, None]
    n = len(origins)
    t_min = np.broadcast_to(np.asarray(t_min, dtype=np.float64), n)
    t_max = np.broadcast_to(np.asarray(t_max, dtype=np.float64), n)
    active = []
    outcomes = [None] * n
    for i in range(n):
        ray = Ray(
            tuple(origins[i].tolist()),
            tuple(directions[i].tolist()),
            float(t_min[i]),
            float(t_max[i]),
            eps,
            cone,
            max_steps,
        )
        walk = walker(ray)
        active.append((i, walk, next(walk)))
    while active:
        at = np.array([i for i, _, _ in active])
        t = np.array([wanted for _, _, wanted in active])
        with np.errstate(invalid="ignore", over="ignore"):
            p = origins[at] + t[:, None] * directions[at]
        values = sample(p).tolist()
        still = []
        for (i, walk, _), value in zip(active, values):
            try:
                still.append((i, walk, walk.send(value)))
            except StopIteration as end:
                outcomes[i] = end.value
        active = still
    return outcomes
