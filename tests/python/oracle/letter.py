"""The sphere tracers exactly as printed, faults included: 000's Algorithms 1 to 4, 002's 2 and 3.

What the print leaves open: a NaN ends the ray as invalid, t starts at t_min, budgets are in evaluations,
and a hit beyond t_max is a miss.
"""

import math

from .common import HIT, INVALID, MISS, OUT_OF_STEPS, Tally, divide


def _exit(ray, tally, t, r):
    """Hit, miss, out of steps, in this order; None while the ray is still active."""
    if r <= ray.threshold(t):
        return tally.end(MISS if t > ray.t_max else HIT, t, r, inside=tally.steps == 1 and r < 0.0)
    if t + r >= ray.t_max:
        return tally.end(MISS, t, r)
    if tally.steps >= ray.max_steps:
        return tally.end(OUT_OF_STEPS, t, r)
    return None


def basic(ray):
    """000, Algorithm 1; the hit is where r was sampled, not t + r."""
    tally = Tally()
    t = ray.t_min
    while True:
        r = yield t
        tally.steps += 1
        if math.isnan(r):
            return tally.end(INVALID, t, r)
        done = _exit(ray, tally, t, r)
        if done:
            return done
        tally.accepted(r, r)
        t = t + r


def relaxed_2023(ray, omega):
    """000, Algorithm 2."""
    tally = Tally()
    t, r, z = ray.t_min, 0.0, 0.0
    while True:
        T = t + z
        R = yield T
        tally.steps += 1
        if math.isnan(R):
            return tally.end(INVALID, T, R)
        if z <= r + abs(R):
            if tally.steps > 1:
                tally.accepted(z, r)
            z = omega * R
            t, r = T, R
        else:
            tally.fallbacks += 1
            z = r
        done = _exit(ray, tally, t, r)
        if done:
            return done


def enhanced_2023(ray, omega):
    """000, Algorithm 3."""
    tally = Tally()
    t = ray.t_min
    r = yield t
    tally.steps += 1
    if math.isnan(r):
        return tally.end(INVALID, t, r)
    z = r
    while True:
        done = _exit(ray, tally, t, r)
        if done:
            return done
        T = t + z
        R = yield T
        tally.steps += 1
        if math.isnan(R):
            return tally.end(INVALID, T, R)
        if z <= r + abs(R):
            tally.accepted(z, r)
            z = R + divide(omega * R * (T - t + R - r), T - t - (R - r))
            t, r = T, R
        else:
            tally.fallbacks += 1
            z = r


def auto_relaxed(ray, beta):
    """000, Algorithm 4."""
    tally = Tally()
    t = ray.t_min
    r = yield t
    tally.steps += 1
    if math.isnan(r):
        return tally.end(INVALID, t, r)
    z, m = r, -1.0
    while True:
        done = _exit(ray, tally, t, r)
        if done:
            return done
        T = t + z
        R = yield T
        tally.steps += 1
        if math.isnan(R):
            return tally.end(INVALID, T, R)
        if z <= r + abs(R):
            tally.accepted(z, r)
            M = divide(R - r, T - t)
            m = (1.0 - beta) * m + beta * M
            t, r = T, R
        else:
            tally.fallbacks += 1
            m = -1.0
        z = divide(2.0 * r, 1.0 - m)


def _retrying(ray, step):
    """The loop of 002's Algorithms 2 and 3: the plain step is retried inside the iteration."""
    tally = Tally()
    t, d, before, r = ray.t_min, 0.0, 0.0, 0.0
    while True:
        d = step(d, before, r)
        R = yield t + d
        tally.steps += 1
        if math.isnan(R):
            return tally.end(INVALID, t + d, R)
        if d > r + R:
            tally.fallbacks += 1
            if tally.steps >= ray.max_steps:
                return tally.end(OUT_OF_STEPS, t, r)
            d = r
            R = yield t + d
            tally.steps += 1
            if math.isnan(R):
                return tally.end(INVALID, t + d, R)
        if r != 0.0:
            tally.accepted(d, r)
        t = t + d
        before, r = r, R
        done = _exit(ray, tally, t, r)
        if done:
            return done


def relaxed_2018(ray, omega):
    """002, Algorithm 2, which writes omega - 1 for this omega."""
    extra = omega - 1.0
    return _retrying(ray, lambda d, before, r: r + extra * r)


def enhanced_2018(ray, omega):
    """002, Algorithm 3; 0/0 in the first iteration counts as 0 (so the second one moves (1 - omega) r)."""

    def step(d, before, r):
        over, under = d - before + r, d + before - r
        ratio = 0.0 if over == 0.0 and under == 0.0 else divide(over, under)
        return r + omega * r * ratio

    return _retrying(ray, step)
