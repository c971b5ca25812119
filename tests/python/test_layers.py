"""Data flows one way: no room imports one to its right. This reads every path in the Rust sources and holds it.

The order stands here once, as two tables. Test modules are exempt, and so is lib.rs, which names all its rooms.
"""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CRATES = ["sdfrs-core", "sdfrs-mesh", "sdfrs-trace", "sdfrs-gpu", "sdfrs", "sdfrs-py"]
# Rooms on one line may use each other, and all rooms above them.
ROOMS = {
    "sdfrs-core": [
        ["error", "fresh", "pages", "pool", "isa", "vectorise"],
        ["real", "math", "lane", "grid", "crowd"],
        ["contract"],
        ["op"],
        ["shape"],
        ["file", "graph"],
        ["fuse"],
        ["tape"],
        ["eval", "field", "prune"],
        ["bake"],
    ],
    "sdfrs-mesh": [
        ["error"],
        ["mesh"],
        ["select"],
        ["read", "check"],
        ["sign"],
        ["lanes", "budget", "exact", "error_bound", "shared"],
        ["frames", "clusters", "pick"],
        ["kernels"],
        ["grid"],
        ["descent", "examine", "sides", "leaves"],
        ["afterwards", "assembly"],
        ["store"],
        ["bricks", "dense"],
        ["bake", "layout"],
    ],
    "sdfrs-trace": [
        ["error", "budget"],
        ["camera"],
        ["tracer"],
        ["march"],
        ["voxel"],
        ["shade", "stats"],
        ["render"],
    ],
    "sdfrs-gpu": [
        ["contract", "error", "pace", "share"],
        ["adapters"],
        ["buffers", "device", "emit", "grids", "pipelines", "scene"],
        ["field"],
        ["camera", "dispatch", "tracer"],
        ["compiled"],
        ["march"],
        ["shade"],
        ["render"],
    ],
}


def code(text: str) -> str:
    """The text without comments, string literals and test modules."""
    text = re.sub(r'r#+".*?"#+|"(\\.|[^"\\])*"', '""', text, flags=re.S)
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r"//[^\n]*", "", text)
    return re.split(r"#\[cfg\(test\)\]\s*mod\s+\w+\s*\{", text)[0]


def expand(path: str) -> list[str]:
    """`a::{b, c::{d, e}}` as the list of its plain paths."""
    match = re.match(r"([^{}]*)\{(.*)\}\s*$", path.strip(), re.S)
    if not match:
        return [path.split(" as ")[0].strip()]
    head, inner = match.groups()
    parts, depth, start = [], 0, 0
    for i, char in enumerate(inner + ","):
        depth += (char == "{") - (char == "}")
        if char == "," and depth == 0:
            parts.append(inner[start:i])
            start = i + 1
    return [head.strip() + tail for part in parts if part.strip() for tail in expand(part)]


def rooms_named(text: str, depth: int) -> set[str]:
    """Top-level modules of its own crate that a source `depth` modules deep names by crate:: or super::."""
    text = code(text)
    paths = [path for use in re.findall(r"\buse\s+([^;]+);", text) for path in expand(use)]
    paths += re.findall(r"(?:\$?crate|(?:super::)*super)::\w+", text)
    named = set()
    for path in paths:
        words = [word for word in path.lstrip("$").split("::") if word]
        supers = sum(word == "super" for word in words)
        if words[:1] == ["crate"]:
            named.add(words[1] if len(words) > 1 else "")
        elif supers >= depth and len(words) > supers:
            named.add(words[supers])
    return named


def sources(crate: str) -> list[Path]:
    files = sorted((ROOT / "crates" / crate / "src").rglob("*.rs"))
    return [file for file in files if file.name not in ("lib.rs", "tests.rs") and "tests" not in file.parts[-2:-1]]


def room(file: Path, crate: str) -> tuple[str, int]:
    """The top-level module a file belongs to, and how many modules deep it lies."""
    parts = list(file.relative_to(ROOT / "crates" / crate / "src").with_suffix("").parts)
    if parts[-1] == "mod":
        parts.pop()
    return parts[0], len(parts)


def test_the_reader_sees_what_it_must() -> None:
    text = 'use crate::{tape::Tape, real::{Real, Scalar}};\n// use crate::file;\nlet a = "crate::graph";\n'
    assert rooms_named(text, 1) == {"tape", "real"}
    assert rooms_named("use super::{error, kind};", 1) == {"error", "kind"}
    assert rooms_named("use super::value; use super::super::op;", 2) == {"op"}
    assert rooms_named("let t = crate::tape::Tape::new();", 1) == {"tape"}
    assert rooms_named("#[cfg(test)]\nmod tests {\n use crate::eval;\n}", 1) == set()


@pytest.mark.parametrize("crate", list(ROOMS))
def test_rooms_import_to_the_left(crate: str) -> None:
    order = {name: level for level, names in enumerate(ROOMS[crate]) for name in names}
    wrong = []
    for file in sources(crate):
        here, depth = room(file, crate)
        assert here in order, f"{file.relative_to(ROOT)}: give room `{here}` its place in tests/python/test_layers.py"
        for other in rooms_named(file.read_text(encoding="utf-8"), depth) - {here}:
            if order.get(other, -1) > order[here]:
                wrong.append(f"{file.relative_to(ROOT)}: `{here}` imports `{other}`, which lies to its right")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("crate", list(ROOMS))
def test_the_table_names_no_room_that_is_gone(crate: str) -> None:
    there = {room(file, crate)[0] for file in sources(crate)}
    named = {name for names in ROOMS[crate] for name in names}
    assert named <= there, f"not in crates/{crate}/src any more: {sorted(named - there)}"


@pytest.mark.parametrize("crate", CRATES)
def test_crates_import_to_the_left(crate: str) -> None:
    later = {name.replace("-", "_") for name in CRATES[CRATES.index(crate) + 1 :]}
    manifest = (ROOT / "crates" / crate / "Cargo.toml").read_text(encoding="utf-8")
    wanted = {name.replace("-", "_") for name in re.findall(r"^(sdfrs[\w-]*)\b", manifest, re.M)}
    assert not wanted & later, f"crates/{crate}/Cargo.toml depends on {sorted(wanted & later)}, to its right"
    for file in sources(crate):
        used = set(re.findall(r"(?<![\w:])(sdfrs\w*)::", code(file.read_text(encoding="utf-8"))))
        assert not used & later, f"{file.relative_to(ROOT)} uses {sorted(used & later)}, to its right"
