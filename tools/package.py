"""Builds the sdist, then a wheel from the sdist alone, checks what an index would show, and fills dist/."""

import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
import zlib
from email.message import Message
from email.parser import Parser
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IN_SDIST = ("PKG-INFO", "README.md", "LICENSE-MIT", "LICENSE-APACHE", "pyproject.toml", "Cargo.lock")
IN_WHEEL = ("sdfrs/__init__.py", "sdfrs/_core.pyi", "sdfrs/py.typed")
NOT_IN_SDIST = ("target", "out", ".venv", "__pycache__", ".git")
FIRST_PICTURE = """
import sdfrs
camera = sdfrs.Camera.look_at(origin=(3, 2, 4), target=(0, 0, 0), width=32, height=24)
print("installed wheel draws", int(sdfrs.render(sdfrs.sphere(1.0), camera).hit.sum()), "pixels of a sphere")
"""


def call(*words: str, cwd: Path = ROOT, **env: str) -> None:
    """Runs a Python module of this interpreter; a failure ends the check."""
    if subprocess.run([sys.executable, *words], cwd=cwd, env={**os.environ, **env}, check=False).returncode:
        sys.exit(f"package: `python {' '.join(words[:4])}` failed; see above.")


def require(condition: object, what: str) -> None:
    if not condition:
        sys.exit(f"package: {what}")


def check_sdist(path: Path) -> None:
    """The sdist holds its texts and no build output."""
    with tarfile.open(path) as archive:
        names = [name.split("/", 1)[1] for name in archive.getnames() if "/" in name]
    for wanted in IN_SDIST:
        require(wanted in names, f"the sdist lacks {wanted}")
    for name in names:
        require(not set(name.split("/")) & set(NOT_IN_SDIST), f"the sdist has swallowed {name}")
        require(not name.endswith((".so", ".pyd")), f"the sdist has swallowed {name}")


def check_metadata(meta: Message) -> None:
    """An index shows the name, one line, the licence, the classifiers and the README."""
    require(meta["Name"] == "sdfrs", f"the wheel is named {meta['Name']}")
    require(meta["License-Expression"] == "MIT OR Apache-2.0", f"licence {meta['License-Expression']}")
    require(meta["Requires-Python"] == ">=3.10", f"Requires-Python {meta['Requires-Python']}")
    require(len(meta["Summary"] or "") > 20, "the summary is missing")
    require(len(meta["Keywords"] or "") > 3, "the keywords are missing")
    require(len(meta.get_all("Classifier", [])) > 8, "classifiers are missing")
    require(set(meta.get_all("License-File", [])) == {"LICENSE-MIT", "LICENSE-APACHE"}, "licence files")
    require("markdown" in (meta["Description-Content-Type"] or ""), "the description is not declared Markdown")
    body = meta.get_payload()
    require(isinstance(body, str) and "# sdfrs" in body, "the README is not the description")


def check_wheel(path: Path) -> None:
    """One abi3 wheel with the types, the licences, the command and good metadata."""
    require("-cp310-abi3-" in path.name, f"{path.name} is no abi3 wheel for CPython 3.10 and later")
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        info = next(name for name in names if name.endswith(".dist-info/METADATA"))
        meta = Parser().parsestr(archive.read(info).decode())
        points = archive.read(info.replace("METADATA", "entry_points.txt")).decode()
    for wanted in IN_WHEEL:
        require(wanted in names, f"the wheel lacks {wanted}")
    for text in ("LICENSE-MIT", "LICENSE-APACHE"):
        require(any(name.endswith(text) for name in names), f"the wheel lacks {text}")
    require("sdfrs=sdfrs.cli:main" in points.replace(" ", ""), "the wheel has no `sdfrs` command")
    check_metadata(meta)


def build(folder: Path) -> tuple[Path, Path]:
    """The sdist of the checkout, and the wheel of that sdist alone, both checked."""
    call("-m", "maturin", "sdist", "--out", str(folder))
    sdist = next(folder.glob("*.tar.gz"))
    check_sdist(sdist)
    with tarfile.open(sdist) as archive:
        archive.extractall(folder)
    unpacked = folder / sdist.name.removesuffix(".tar.gz")
    # All files of an sdist have one old date: cargo would take what it built from another sdist for this one's.
    for path in unpacked.rglob("*"):
        os.utime(path)
    call("-m", "maturin", "build", "--locked", "--out", str(folder), cwd=unpacked)
    wheel = next(folder.glob("*.whl"))
    check_wheel(wheel)
    return sdist, wheel


def main() -> None:
    dist = ROOT / "dist"
    # Outside the checkout, so that nothing of it can leak into the build; always the same place for the same
    # checkout, so that cargo's cache is found again and does not grow with each run.
    folder = Path(tempfile.gettempdir()) / f"sdfrs-package-{zlib.crc32(str(ROOT).encode()):08x}"
    shutil.rmtree(folder, ignore_errors=True)
    try:
        sdist, wheel = build(folder)
        call("-m", "twine", "check", "--strict", str(sdist), str(wheel))
        call("-m", "pip", "install", "-q", "--no-deps", "--target", str(folder / "site"), str(wheel), cwd=folder)
        call("-c", FIRST_PICTURE, cwd=folder, PYTHONPATH=str(folder / "site"))
        shutil.rmtree(dist, ignore_errors=True)
        dist.mkdir()
        for made in (sdist, wheel):
            shutil.copy(made, dist)
            print(f"dist/{made.name}  {made.stat().st_size / 1e6:.2f} MB")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
