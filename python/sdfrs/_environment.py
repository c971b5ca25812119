"""Settings from the environment: one that names nothing is said, not passed over."""

from __future__ import annotations

import os
import warnings

from . import _core


def check() -> None:
    """Warns (RuntimeWarning) of settings that have no effect."""
    isa = os.environ.get("SDFRS_ISA", "")
    if isa and isa not in _core.simd_levels():
        _ignored("SDFRS_ISA", isa, ", ".join(_core.simd_levels()))
    threads = os.environ.get("SDFRS_THREADS", "")
    if threads and not (threads.isascii() and threads.isdigit()):
        _ignored("SDFRS_THREADS", threads, "a whole number")


def _ignored(name: str, value: str, allowed: str) -> None:
    warnings.warn(f"{name}: got {value!r}, which is ignored, allowed: {allowed}", RuntimeWarning, stacklevel=4)
