"""An independent float64 reading of the tracers, in plain Python, one ray at a time.

It shares no code with the library. Every tracer is a generator: it yields the ray parameter it wants
sampled and receives the field's value there, so that the text of each walk stays as short as the
listing it follows, and `walk` may feed many rays from one vectorised look-up of the grid.
"""

from .field import Grid
from .walk import Outcome, trace, walkers

__all__ = ["Grid", "Outcome", "trace", "walkers"]
