"""A trilinear, node-centred grid of distances, and the step that is safe through it."""

import numpy as np

SQRT3 = np.sqrt(3.0)


class Grid:
    """values[z, y, x] over the box lo..hi; the first and the last node of an axis lie on the box."""

    def __init__(self, values, lo, hi, raw=False):
        """`raw` samples the values as they are; otherwise the safe-step rule is applied."""
        self.values = np.ascontiguousarray(values, dtype=np.float64)
        self.lo = np.asarray(lo, dtype=np.float64)
        self.hi = np.asarray(hi, dtype=np.float64)
        self.count = np.array(self.values.shape[::-1])
        self.spacing = (self.hi - self.lo) / (self.count - 1)
        self.raw = raw

    def interpolate(self, q):
        """The interpolant at points inside the box: a + f*(b-a) along x, then y, then z."""
        u = (q - self.lo) / self.spacing
        cell = np.clip(np.floor(u), 0, self.count - 2).astype(np.int64)
        fx, fy, fz = (u - cell).T
        x, y, z = cell.T
        v = self.values
        along_x = [[_mix(v[z + k, y + j, x], v[z + k, y + j, x + 1], fx) for j in (0, 1)] for k in (0, 1)]
        along_y = [_mix(row[0], row[1], fy) for row in along_x]
        return _mix(along_y[0], along_y[1], fz)

    def safe(self, v):
        """The interpolant of 1-Lipschitz samples has slope up to sqrt(3) and errs by less than sqrt(3) h."""
        if self.raw:
            return v
        return np.maximum(v / SQRT3, v - SQRT3 * self.spacing.max())

    def sample(self, p):
        """What a tracer sees at the points p (N, 3)."""
        p = np.asarray(p, dtype=np.float64)
        with np.errstate(invalid="ignore", over="ignore"):
            bad = ~np.isfinite(p).all(axis=1)
            nowhere = np.isnan(p).any(axis=1)
            q = np.clip(np.where(nowhere[:, None], self.lo, p), self.lo, self.hi)
            v = self.safe(self.interpolate(q))
            gap = p - q
            gap = np.sqrt(gap[:, 0] ** 2 + gap[:, 1] ** 2 + gap[:, 2] ** 2)
            out = np.where(gap > 0.0, np.maximum(gap, v - gap), v)
        out[bad] = np.inf
        out[nowhere] = np.nan
        return out


def _mix(a, b, f):
    return a + f * (b - a)
