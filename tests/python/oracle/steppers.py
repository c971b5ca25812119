"""The guarded sphere-tracing steppers: one walk, five rules for the next step."""

import math

from .common import HIT, INVALID, MISS, OUT_OF_STEPS, ULP, Tally


def plain(r, m):
    return r


def relaxed(omega):
    return lambda r, m: omega * r


def enhanced(omega):
    return lambda r, m: r * (1.0 + omega * (1.0 + m) / (1.0 - m))


def auto_relaxed(r, m):
    return r * max(1.0, 2.0 / (1.0 - m))


def guarded(ray, propose, first=1.0, beta=1.0):
    """`propose(r, m)` is the step tried next; `first` scales the first one; `beta` averages the slope."""
    tally = Tally()
    t = ray.t_min
    r = yield t
    tally.steps += 1
    if not math.isfinite(r):
        return tally.end(INVALID, t, r)
    e = ray.guarded_threshold(t)
    if r <= e:
        if t > ray.t_max:
            return tally.end(MISS, t, r)
        return tally.end(HIT, t, r, inside=r < -e)
    z = first * r
    m = -1.0
    while True:
        if t + r >= ray.t_max:
            return tally.end(MISS, t, r)
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, t, r)
        T = min(t + z, ray.t_max)
        dz = T - t
        basic = not z > r
        R = yield T
        tally.steps += 1
        if not math.isfinite(R):
            if basic:
                return tally.end(INVALID, T, R)
            tally.fallbacks += 1
            z, m = r, -1.0
            continue
        if not (basic or dz + 2.0 * ULP * abs(T) <= r + R):
            tally.fallbacks += 1
            z, m = r, -1.0
            continue
        tally.saw(dz, R - r, T)
        tally.accepted(dz, r)
        e = ray.guarded_threshold(T)
        if R < -e:
            tally.crossing = True
            t, r = yield from illinois(ray, tally, t, r, T, R)
            return tally.end(HIT, t, r)
        M = min(max((R - r) / dz, -1.0), 0.9)
        m = M if beta == 1.0 else m + beta * (M - m)
        t, r = T, R
        if r <= e:
            return tally.end(HIT, t, r)
        if T >= ray.t_max:
            return tally.end(MISS, t, r)
        z = propose(r, m)


def illinois(ray, tally, a, fa, b, fb):
    """False position with halved weights between a sample outside and one inside; ends outside.

    It looks for half the threshold, so that what it accepts lies outside. A weight is halved when its
    end has been kept twice in a row.
    """
    aim = ray.guarded_threshold(b) / 2.0
    ga, gb = fa - aim, fb - aim
    out, r_out = a, fa
    kept = None
    for _ in range(5):
        if tally.steps >= ray.max_steps:
            break
        c = b - gb * (b - a) / (gb - ga)
        fc = yield c
        tally.steps += 1
        if not math.isfinite(fc):
            break
        if fc >= 0.0:
            out, r_out = c, fc
            if fc <= ray.guarded_threshold(c):
                break
            a, ga = c, fc - aim
            gb = gb / 2.0 if kept == "b" else gb
            kept = "b"
        else:
            b, gb = c, fc - aim
            ga = ga / 2.0 if kept == "a" else ga
            kept = "a"
    return out, r_out
