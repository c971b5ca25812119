"""What this installation has, what it lacks, and how to get it."""

from __future__ import annotations

import platform
import sys
from importlib import metadata
from typing import Any

from . import _core
from ._errors import DeviceError

_OPTIONAL = {
    "Pillow": "needed for pictures and heat maps",
    "tqdm": "a progress bar; without it a plain line",
}


_DRIVER = {
    "debian": "apt install mesa-vulkan-drivers libvulkan1",
    "fedora": "dnf install mesa-vulkan-drivers vulkan-loader",
    "arch": "pacman -S vulkan-icd-loader mesa vulkan-swrast",
    "suse": "zypper install Mesa-vulkan-device-select libvulkan1 libvulkan_lvp",
}


def _driver() -> str:
    """The command that installs a GPU driver here, or what to look for."""
    if not sys.platform.startswith("linux"):
        return "install or update the driver of the graphics card's vendor"
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        release = {}
    family = f"{release.get('ID', '')} {release.get('ID_LIKE', '')}"
    own = [command for name, command in _DRIVER.items() if name in family]
    return (own or [_DRIVER["debian"]])[0] + " (NVIDIA: the vendor's driver)"


def _gpus() -> tuple[list[str], list[str]]:
    """The GPUs in words, and what is missing."""
    try:
        found = _core.adapters()
    except DeviceError as error:
        return [f"gpu: {error}"], [f"GPU: {error}"]
    words, missing = [], []
    for number, gpu in enumerate(found):
        limits = f"bindings of {gpu['max_binding_bytes'] >> 20} MiB, buffers of {gpu['max_buffer_bytes'] >> 20} MiB"
        fault = f"; unusable: {gpu['missing']}" if gpu["missing"] else ""
        words.append(f"gpu:{number} {gpu['name']} ({gpu['kind']}, {gpu['backend']}, {gpu['driver']}; {limits}{fault})")
    if not any(gpu["missing"] is None for gpu in found):
        missing.append(f"a GPU driver: needed for device='gpu'; get it with: {_driver()}")
    elif all(gpu["kind"] == "software" for gpu in found):
        missing.append(f"a real GPU: what there is runs on the processor, and device='auto' takes the CPU; {_driver()}")
    return words, missing


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "missing"


def examine() -> dict[str, Any]:
    """Versions, threads, instruction set, GPUs with their limits, and what is missing with the command that gets it.

    Examples:
        >>> from sdfrs.doctor import examine
        >>> examine()["threads"] >= 1
        True
    """
    gpus, lacking = _gpus()
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
        "devices": ["cpu", *gpus],
        "missing": missing + lacking,
    }
