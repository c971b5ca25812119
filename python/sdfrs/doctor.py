"""What this installation has, what it lacks, and how to get it."""

from __future__ import annotations

import platform
import sys
from importlib import metadata
from typing import Any

from . import _core

_OPTIONAL = {
    "Pillow": "needed for pictures and heat maps",
    "tqdm": "a progress bar; without it a plain line",
}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "missing"


def examine() -> dict[str, Any]:
    """Versions, threads, instruction set, and what is missing with the command that gets it.

    Examples:
        >>> from sdfrs.doctor import examine
        >>> examine()["threads"] >= 1
        True
    """
    found = {name: _version(name) for name in ("numpy", *_OPTIONAL)}
    missing = [
        f"{name}: {why}; get it with: {sys.executable} -m pip install {name}"
        for name, why in _OPTIONAL.items()
        if found[name] == "missing"
    ]
    return {
        "sdfrs": _core.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        **found,
        "threads": _core.threads(),
        "instructions": _core.simd_level(),
        "devices": "cpu (this build has no other)",
        "missing": missing,
    }
