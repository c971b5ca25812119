"""What `progress=` takes: None, True (tqdm if installed, else a line on stderr) or a callable(done, total)."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Optional, Union

from . import _check

Progress = Union[None, bool, Callable[[int, int], Any]]


@contextmanager
def reporter(progress: Progress, what: str, unit: str = "ray") -> Iterator[Optional[Callable[[int, int], Any]]]:
    """The callback to hand to the compiled module, closed at the end."""
    if progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    elif progress is True:
        try:
            from tqdm import tqdm
        except ImportError:
            line = _Line(what)
            try:
                yield line
            finally:
                line.close()
        else:
            with tqdm(desc=what, unit=unit, unit_scale=True, leave=False, file=sys.stderr) as bar:

                def update(done: int, total: int) -> None:
                    bar.total = total
                    bar.update(done - bar.n)

                yield update
    else:
        raise TypeError(f"progress must be None, True or a function of (done, total), got {_check.show(progress)}")


class _Line:
    """A line on stderr, rewritten a few times a second."""

    def __init__(self, what: str) -> None:
        self._what, self._last, self._shown = what, 0.0, False

    def __call__(self, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._last >= 0.2:
            self._last, self._shown = now, True
            print(f"\r{self._what}: {100 * done // max(total, 1):3d} %", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._shown:
            print(f"\r{self._what}: done", file=sys.stderr, flush=True)
