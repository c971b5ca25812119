"""Searches that halve the ray: 003's three listings, to the letter and guarded, and 004's coverage search."""

import math

from .common import HIT, INVALID, MISS, OUT_OF_STEPS, Tally

STACK = 32


def _sample(ray, tally, t):
    r = yield t
    tally.steps += 1
    return r


def stackless_letter(ray, max_level=18):
    """003's last listing, with seg >>= 1 for the misprint."""
    tally = Tally()
    lev = seg = 0
    while True:
        tle = (ray.t_max - ray.t_min) * 2.0**-lev
        tce = ray.t_min + tle * (seg + 0.5)
        tra = 0.5 * tle
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, tce - tra, math.nan)
        d = yield from _sample(ray, tally, tce)
        if math.isnan(d):
            return tally.end(INVALID, tce, d)
        if d < tra:
            if tra < ray.threshold(tce) or lev > max_level:
                return tally.end(HIT, tce - tra, d)
            lev, seg = lev + 1, seg << 1
        else:
            while seg & 1:
                lev, seg = lev - 1, seg >> 1
            seg += 1
            if lev == 0:
                return tally.end(MISS, math.inf, d)


def stack_letter(ray):
    """003's first listing."""
    return _stack_letter(ray, split=False)


def split_letter(ray):
    """003's second listing, Klenert's; it need not end by itself."""
    return _stack_letter(ray, split=True)


def _stack_letter(ray, split):
    tally = Tally()
    x, y = ray.t_min, ray.t_max
    stack = []
    while True:
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, x, math.nan)
        tcen = 0.5 * (y + x)
        trad = 0.5 * (y - x)
        d = yield from _sample(ray, tally, tcen)
        if math.isnan(d):
            return tally.end(INVALID, tcen, d)
        if d < trad:
            th = ray.threshold(tcen)
            if trad < th:
                return tally.end(HIT, x, d)
            if split:
                stack.append((tcen + d - th, y))
                y = tcen - d + th
            else:
                stack.append((tcen, y))
                y = tcen
        elif stack:
            x, y = stack.pop()
        else:
            return tally.end(MISS, math.inf, d)


def _levels(ray):
    spread = (ray.t_max - ray.t_min) / ray.eps
    return math.ceil(math.log2(spread)) if spread > 1.0 else 0


def stackless(ray):
    """Halves by address; a ball must cover its segment with e/2 to spare to clear it."""
    tally = Tally()
    lev = seg = 0
    deepest = _levels(ray)
    while True:
        tle = (ray.t_max - ray.t_min) * 2.0**-lev
        tce = ray.t_min + tle * (seg + 0.5)
        tra = 0.5 * tle
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, tce - tra, math.nan)
        d = yield from _sample(ray, tally, tce)
        if not math.isfinite(d):
            return tally.end(INVALID, tce, d)
        e = ray.guarded_threshold(tce)
        if d - e / 2.0 <= tra:
            if tra < e or lev > deepest:
                return tally.end(HIT, tce - tra, d)
            lev, seg = lev + 1, seg << 1
        else:
            while seg & 1:
                lev, seg = lev - 1, seg >> 1
            seg += 1
            if lev == 0:
                return tally.end(MISS, math.inf, d)


def stack(ray):
    """The same search with its segments on a stack."""
    tally = Tally()
    x, y, lev = ray.t_min, ray.t_max, 0
    waiting = []
    deepest = _levels(ray)
    while True:
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, x, math.nan)
        tcen = 0.5 * (y + x)
        trad = 0.5 * (y - x)
        d = yield from _sample(ray, tally, tcen)
        if not math.isfinite(d):
            return tally.end(INVALID, tcen, d)
        e = ray.guarded_threshold(tcen)
        if d - e / 2.0 <= trad:
            if trad < e or lev > deepest:
                return tally.end(HIT, x, d)
            lev += 1
            waiting.append((tcen, y, lev))
            y = tcen
        elif waiting:
            x, y, lev = waiting.pop()
        else:
            return tally.end(MISS, math.inf, d)


def split(ray):
    """Cuts the empty span out of the middle, shrunk by e/2; on 1-Lipschitz fields it samples what `coverage` does.

    What waits is not trimmed when a later ball reaches into it: that is the merging it does without.
    """
    tally = Tally()
    x, y, hit = ray.t_min, ray.t_max, False
    waiting = []
    e = 0.0  # of the last sample; read only once there is a hit sample
    while True:
        if y <= x or (hit and not waiting and y - x <= e / 2.0):
            if not waiting:
                return tally.end(HIT if hit else MISS, min(x, y), math.nan)
            x, y = waiting.pop()
            continue
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, x, math.nan)
        p = (x + y) / 2.0
        d = yield from _sample(ray, tally, p)
        if not math.isfinite(d):
            return tally.end(INVALID, p, d)
        e = ray.guarded_threshold(p)
        if d <= e:
            hit = True
            waiting.clear()
            y = p - max(-d, 0.0)
            if y <= x:
                return tally.end(HIT, min(x, p), d)
            continue
        q = d - e / 2.0
        waiting.append((p + q, y))
        y = p - q


def coverage(ray):
    """Spans known empty, nearest on top; the middle of the nearest gap is sampled next."""
    tally = Tally()
    cur, end, hit = ray.t_min, ray.t_max, False
    spans = []
    e = 0.0  # of the last sample; read only once there is a hit sample
    while True:
        top = spans[-1][0] if spans else end
        if top <= cur or (hit and not spans and top - cur <= e / 2.0):
            if not spans:
                return tally.end(HIT, min(cur, end), math.nan) if hit else tally.end(MISS, cur, math.nan)
            cur = max(cur, spans.pop()[1])
            if cur >= end and not hit:
                return tally.end(MISS, cur, math.nan)
            continue
        if tally.steps >= ray.max_steps:
            return tally.end(OUT_OF_STEPS, cur, math.nan)
        if len(spans) >= STACK:
            r = yield from _sample(ray, tally, cur)
            if not math.isfinite(r):
                return tally.end(INVALID, cur, r)
            if r <= ray.guarded_threshold(cur):
                return tally.end(HIT, cur, r)
            cur = cur + r
            continue
        p = (cur + top) / 2.0
        r = yield from _sample(ray, tally, p)
        if not math.isfinite(r):
            return tally.end(INVALID, p, r)
        e = ray.guarded_threshold(p)
        if r <= e:
            hit = True
            spans.clear()
            end = p + min(r, 0.0)
            if end <= cur:
                return tally.end(HIT, min(cur, p), r)
            continue
        q = r - e / 2.0
        low, high = p - q, p + q
        if high >= top:
            if spans:
                spans[-1] = (low, max(spans[-1][1], high))
            elif hit:
                if low <= cur:
                    return tally.end(HIT, end, r)
                spans.append((low, end))
            else:
                spans.append((low, high))
        else:
            spans.append((low, high))
