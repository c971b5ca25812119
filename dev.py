#!/usr/bin/env python3
"""Every chore of this repository, with the standard library alone: `python3 dev.py` lists them.

The tools live in .venv, which is made, filled and rebuilt on demand. CARGO_TARGET_DIR is honoured.
"""

import argparse
import hashlib
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

if sys.version_info < (3, 10):  # noqa: UP036 - this is how an older one is told
    sys.exit(f"dev.py: Python 3.10 or newer is needed, this is {sys.version.split()[0]}.")

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
STATE = VENV / "sdfrs-dev.json"
RUST = (1, 89)

# Installed by group and only when a command needs the group: a first demo should not wait for linters.
TOOLS = {
    "run": ["maturin>=1.10,<2", "numpy>=1.23", "Pillow>=9.1", "tqdm>=4.60"],
    "test": ["pytest>=7.4", "hypothesis>=6.80", "trimesh>=4"],
    "lint": ["ruff>=0.6", "mypy>=1.10"],
    "package": ["twine>=6.1", "packaging>=24.2"],
}
PYTHON_CODE = ["dev.py", "tools", "python", "examples", "benches/import_time.py", "tests/python"]
MYPY_CODE = ["python/sdfrs", "examples/02_compare_tracers.py", "examples/03_formula.py", "examples/demo.py"]


def fail(sentence: str) -> None:
    """Ends the run with one sentence that says what is missing or what failed."""
    sys.stdout.flush()
    sys.exit(f"dev.py: {sentence}")


def environment() -> dict[str, str]:
    """The environment commands run in: the venv first, then cargo where rustup puts it."""
    env = dict(os.environ)
    cargo_home = Path(env.get("CARGO_HOME", Path.home() / ".cargo"))
    env["PATH"] = os.pathsep.join([str(BIN), env.get("PATH", ""), str(cargo_home / "bin")])
    env["VIRTUAL_ENV"] = str(VENV)
    # pyo3's build script asks for an interpreter: naming one keeps cargo and maturin on the same build.
    env["PYO3_PYTHON"] = str(PYTHON)
    # pip repeats every satisfied requirement and every extra that it ignores.
    env["PIP_QUIET"] = "1"
    env["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    # Mesa complains on stderr without one.
    env.setdefault("XDG_RUNTIME_DIR", str(VENV))
    env.pop("PYTHONHOME", None)
    env.pop("CONDA_PREFIX", None)
    return env


def run(*command: object, check: bool = True, quiet: bool = False, to: Path | None = None) -> int:
    """Runs a command in the repository root, shown first; a failure ends the run where `check` is set.

    What it prints is written `to` a file as well, once all of it is there."""
    words = [str(word) for word in command]
    env = environment()
    if not quiet:
        shown = [Path(words[0]).name, *words[1:]]
        print(f"$ {' '.join(shown)}", file=sys.stderr, flush=True)
    program = shutil.which(words[0], path=env["PATH"]) or words[0]
    if to is None:
        code = subprocess.run([program, *words[1:]], cwd=ROOT, env=env, check=False).returncode
    else:
        code = copied([program, *words[1:]], env, to)
    if check and code:
        fail(f"`{Path(words[0]).name} {' '.join(words[1:3])}` failed with exit code {code}; its message is above.")
    return code


def copied(command: list[str], env: dict[str, str], to: Path) -> int:
    """Runs a command whose lines go to the screen and, if it ends well, to a file."""
    lines = []
    with subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout or ():
            print(line, end="", flush=True)
            lines.append(line)
    if process.returncode == 0:
        to.parent.mkdir(parents=True, exist_ok=True)
        to.write_text("".join(lines), encoding="utf-8")
        print(f"written to {to.relative_to(ROOT)}", file=sys.stderr)
    return process.returncode


def need_cargo(*components: str) -> None:
    """Says in one sentence what is missing of the Rust toolchain."""
    path = environment()["PATH"]
    cargo = shutil.which("cargo", path=path)
    if cargo is None:
        fail("cargo is missing: install Rust 1.89 or newer from https://rustup.rs, then run this again.")
    answer = subprocess.run([str(cargo), "--version"], cwd=ROOT, capture_output=True, text=True, check=False)
    version = re.search(r"(\d+)\.(\d+)", answer.stdout)
    if version is None:
        fail(f"`cargo --version` does not answer: {answer.stderr.strip() or 'no output'}")
    elif tuple(map(int, version.groups())) < RUST:
        fail(f"cargo {version[0]} is too old, 1.89 or newer is needed: run `rustup update stable`.")
    for component in components:
        if shutil.which(component, path=path) is None:
            fail(f"{component} is missing: run `rustup component add rustfmt clippy`.")


def state() -> dict[str, object]:
    """What is installed and built in .venv, as the last run left it."""
    try:
        found = json.loads(STATE.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def remember(**news: object) -> None:
    STATE.write_text(json.dumps({**state(), **news}, indent=1), encoding="utf-8")


def ensure_venv() -> None:
    """Makes .venv; where the distribution left ensurepip out, the outer pip puts a pip into it."""
    if PYTHON.exists():
        return
    print("making .venv", file=sys.stderr)
    has_ensurepip = importlib.util.find_spec("ensurepip") is not None
    options = ["--clear"] if has_ensurepip else ["--clear", "--without-pip"]
    if subprocess.run([sys.executable, "-m", "venv", *options, str(VENV)], check=False).returncode:
        fail("the venv could not be made: install your distribution's python3-venv package.")
    if not has_ensurepip:
        outer = [sys.executable, "-m", "pip", "--python", str(PYTHON), "install", "-q", "pip"]
        if subprocess.run(outer, check=False).returncode:
            shutil.rmtree(VENV, ignore_errors=True)
            fail("neither ensurepip nor pip 22.3 or newer is here: install python3-venv or python3-pip.")


def ensure_tools(*groups: str) -> None:
    """Installs the named groups into .venv, once per change of their list."""
    ensure_venv()
    have = state().get("tools")
    have = dict(have) if isinstance(have, dict) else {}
    missing = [group for group in groups if have.get(group) != TOOLS[group]]
    if not missing:
        return
    wanted = [tool for group in missing for tool in TOOLS[group]]
    print(f"installing {', '.join(wanted)}", file=sys.stderr)
    if run(PYTHON, "-m", "pip", "install", *wanted, check=False, quiet=True):
        fail("pip could not install the tools named above: check the network or pip's index settings.")
    remember(tools={**have, **{group: TOOLS[group] for group in missing}})


def sources_hash() -> str:
    """A digest of all that the extension is built from.

    python/ is left out on purpose: the install is editable, so a changed .py file needs no build.
    """
    digest = hashlib.sha256()
    files = [ROOT / "Cargo.toml", ROOT / "Cargo.lock", ROOT / "pyproject.toml"]
    for folder in ("crates", "shaders"):
        files += sorted(p for p in (ROOT / folder).rglob("*") if "target" not in p.relative_to(ROOT).parts)
    for file in files:
        if file.is_file():
            digest.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    # ROOT too: an editable install of a folder that has moved points nowhere.
    digest.update(f"{ROOT} {sys.version_info[:2]} {os.environ.get('RUSTFLAGS', '')}".encode())
    return digest.hexdigest()


def ensure_built() -> None:
    """Builds the extension into .venv when a source changed since the last build."""
    if not PYTHON.exists():
        need_cargo()  # said before anything is installed
    ensure_tools("run")
    # `maturin develop` may write Cargo.lock, so the digest is taken again after the build.
    built = any(ROOT.glob("python/sdfrs/_core*.so")) or any(ROOT.glob("python/sdfrs/_core*.pyd"))
    if built and state().get("built") == sources_hash():
        return
    need_cargo()
    start = time.monotonic()
    if run(PYTHON, "-m", "maturin", "develop", check=False):
        hint = "" if os.name == "nt" or shutil.which("cc") else " No C linker (cc) was found: install gcc or clang."
        fail(f"the extension did not build; the compiler's message is above.{hint}")
    remember(built=sources_hash())
    print(f"built in {time.monotonic() - start:.0f} s", file=sys.stderr)


def ensure_vulkan() -> None:
    """A GPU driver for the tests that dispatch: Mesa's in software where Debian and root allow it, else a word."""
    folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"]
    named = "VK_DRIVER_FILES" in os.environ or "VK_ICD_FILENAMES" in os.environ
    if not sys.platform.startswith("linux") or named or any(any(Path(folder).glob("*.json")) for folder in folders):
        return
    packages = ("mesa-vulkan-drivers", "libvulkan1")
    if os.geteuid() == 0 and shutil.which("apt-get"):
        print("installing a Vulkan driver in software for the GPU tests", file=sys.stderr)
        for options in (("-q", "update"), ("-qy", "install", "--no-install-recommends", *packages)):
            run("apt-get", *options, check=False)
    if not any(any(Path(folder).glob("*.json")) for folder in folders):
        print(f"left out: tests that need a GPU driver (Debian: apt install {' '.join(packages)})", file=sys.stderr)


def demo(options: argparse.Namespace, rest: list[str]) -> None:
    """build if needed, render two scenes by every tracer into out/demo, print one table"""
    ensure_built()
    run(PYTHON, "examples/demo.py", *(["--quick"] if options.quick else []), *rest)


def test(_: argparse.Namespace, rest: list[str]) -> None:
    """Rust tests, then Python tests; further arguments go to pytest"""
    ensure_built()
    ensure_tools("test")
    need_cargo()
    ensure_vulkan()
    # The bindings have no Rust tests: linking them outside Python is trouble for nothing.
    rust = run("cargo", "test", "--workspace", "--exclude", "sdfrs-py", "--no-fail-fast", check=False)
    python = run(PYTHON, "-m", "pytest", *(rest or ["tests/python"]), check=False)
    parts = [name for name, code in (("cargo test", rust), ("pytest", python)) if code]
    if parts:
        fail(f"{' and '.join(parts)} failed; see above.")


def lint(_: argparse.Namespace, rest: list[str]) -> None:
    """rustfmt, clippy, ruff, mypy (strict), stubs up to date: all of them, then what failed"""
    ensure_built()
    ensure_tools("test", "lint")
    need_cargo("rustfmt", "cargo-clippy")
    code = [path for path in PYTHON_CODE if (ROOT / path).exists()]
    checks: dict[str, list[object]] = {
        "rustfmt": ["cargo", "fmt", "--all", "--check"],
        "clippy": ["cargo", "clippy", "--workspace", "--all-targets", "--", "-D", "warnings"],
        "ruff check": [PYTHON, "-m", "ruff", "check", *code],
        "ruff format": [PYTHON, "-m", "ruff", "format", "--check", *code],
        "mypy": [PYTHON, "-m", "mypy", *MYPY_CODE],
        "stubs": [PYTHON, "tools/stubs.py", "--check"],
    }
    if shutil.which("cargo-deny", path=environment()["PATH"]):
        checks["cargo deny"] = ["cargo", "deny", "check", "bans", "licenses", "sources"]
    failed = [name for name, command in checks.items() if run(*command, check=False)]
    if failed:
        fail(f"{', '.join(failed)} failed; see above (`python3 dev.py format` repairs the layout).")
    print(f"lint: {', '.join(checks)} clean")


def layout(_: argparse.Namespace, rest: list[str]) -> None:
    """rewrites the code in the house's layout (cargo fmt, ruff --fix, ruff format)"""
    ensure_tools("lint")
    need_cargo("rustfmt")
    code = [path for path in PYTHON_CODE if (ROOT / path).exists()]
    run("cargo", "fmt", "--all")
    run(PYTHON, "-m", "ruff", "check", "--fix", *code, check=False)
    run(PYTHON, "-m", "ruff", "format", *code)


def stubs(_: argparse.Namespace, rest: list[str]) -> None:
    """regenerates python/sdfrs/_core.pyi from the bindings"""
    ensure_tools("run", "lint")
    need_cargo()
    run(PYTHON, "tools/stubs.py", *rest)


def gallery(_: argparse.Namespace, rest: list[str]) -> None:
    """runs every numbered example; the pictures land in out/"""
    ensure_built()
    for example in sorted((ROOT / "examples").glob("[0-9][0-9]_*.py")):
        run(PYTHON, example.relative_to(ROOT))


def bench(options: argparse.Namespace, rest: list[str]) -> None:
    """speed against peers as the table of docs/performance.md; --criterion times at length; --gpu for docs/gpu.md's"""
    need_cargo()
    peers = ("--manifest-path", "benches/Cargo.toml")
    if options.gpu:
        table = ROOT / "out" / "gpu-table.md"
        run("cargo", "run", "-q", *peers, "--features", "gpu", "--bin", "gpu", "--", *rest, to=table)
    elif options.criterion:
        run("cargo", "bench", *peers, "--bench", "speed", "--", *rest)
    else:
        run("cargo", "run", "-q", *peers, "--bin", "ratios", "--", *rest)
        if not rest:
            ensure_built()
            run(PYTHON, "benches/import_time.py")


def doctor(_: argparse.Namespace, rest: list[str]) -> None:
    """what this machine has and what is missing, by `sdfrs doctor`"""
    ensure_built()
    run("sdfrs", "doctor", *rest)


def package(_: argparse.Namespace, rest: list[str]) -> None:
    """sdist, a wheel built from the sdist alone, and their metadata checked, into dist/"""
    ensure_tools("run", "package")
    need_cargo()
    run(PYTHON, "tools/package.py", *rest)


COMMANDS = {
    "demo": demo,
    "test": test,
    "lint": lint,
    "format": layout,
    "stubs": stubs,
    "gallery": gallery,
    "bench": bench,
    "doctor": doctor,
    "package": package,
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="dev.py", description="The chores of this repository.")
    subparsers = parser.add_subparsers(dest="command", metavar="command")
    for name, function in COMMANDS.items():
        sub = subparsers.add_parser(name, help=function.__doc__)
        if name == "demo":
            sub.add_argument("--quick", action="store_true", help="320x180 instead of 1280x720")
        if name == "bench":
            sub.add_argument("--gpu", action="store_true", help="tracers on the GPU, relative to enhanced")
            sub.add_argument("--criterion", action="store_true", help="the criterion groups instead of the table")
    options, rest = parser.parse_known_args()
    if options.command is None:
        parser.print_help()
        return
    COMMANDS[options.command](options, rest)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
