"""What every walk shares: statuses, thresholds, the outcome, the samples it has spent."""

import math
from dataclasses import dataclass

MISS, HIT, OUT_OF_STEPS, INVALID = range(4)
ULP = 2.0**-52


@dataclass
class Outcome:
    t: float
    status: int
    steps: int
    fallbacks: int = 0
    multiplier: float = 1.0
    witness: float = 0.0
    crossing: bool = False
    inside: bool = False
    distance: float = math.nan


@dataclass
class Ray:
    """One ray and its limits; direction of unit length."""

    origin: tuple
    direction: tuple
    t_min: float
    t_max: float
    eps: float
    cone: float
    max_steps: int

    def threshold(self, t):
        """World distance below which a sample is a hit, as the listings have it."""
        return max(self.eps, self.cone * t)

    def floor(self, t):
        """4 ulp of the largest number that takes part in finding the point at t."""
        reach = max(abs(o + t * d) for o, d in zip(self.origin, self.direction))
        return 4.0 * ULP * max(reach, abs(t))

    def guarded_threshold(self, t):
        return max(self.threshold(t), self.floor(t))


def divide(a, b):
    """a / b as the floating-point unit has it, instead of Python's exception."""
    if b != 0.0:
        return a / b
    if a == 0.0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


class Tally:
    """The counts of one walk."""

    def __init__(self):
        self.steps = 0
        self.fallbacks = 0
        self.crossing = False
        self.witness = 0.0
        self._multipliers = []

    def accepted(self, length, radius):
        self._multipliers.append(divide(length, radius))

    def saw(self, dz, dr, t):
        if dz > 64.0 * ULP * abs(t):
            self.witness = max(self.witness, abs(dr) / dz)

    def end(self, status, t, distance, inside=False):
        steps = self._multipliers
        return Outcome(
            t=math.inf if status == MISS else t,
            status=status,
            steps=self.steps,
            fallbacks=self.fallbacks,
            multiplier=sum(steps) / len(steps) if steps else 1.0,
            witness=self.witness,
            crossing=self.crossing,
            inside=inside,
            distance=distance,
        )
