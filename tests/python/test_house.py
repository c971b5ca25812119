"""What a new op, tracer or shape must be entered in, and whether the texts about this repository are true.

Each failure names what was forgotten and the recipe in CONTRIBUTING.md that would not have.
"""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "crates" / "sdfrs-core" / "src"
TRACE = ROOT / "crates" / "sdfrs-trace" / "src"
TEXTS = (
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/scene-format.md",
    "docs/texture-format.md",
    "docs/tracers.md",
)
LONGEST = 400


def read(path: str | Path) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


def together(*patterns: str) -> str:
    """The text of all files that match, as one."""
    files = sorted(file for pattern in patterns for file in ROOT.glob(pattern))
    assert files, f"nothing matches {patterns}"
    return "\n".join(file.read_text(encoding="utf-8") for file in files)


def rust_tests() -> str:
    """All Rust test code: tests.rs files, #[cfg(test)] modules, and the laws."""
    found = [together("tests/**/*.rs")]
    for file in sorted((ROOT / "crates").rglob("*.rs")):
        text = file.read_text(encoding="utf-8")
        if file.name == "tests.rs" or "tests" in file.parts:
            found.append(text)
        else:
            found += re.split(r"#\[cfg\(test\)\]\s*mod\s+\w+\s*\{", text)[1:]
    return "\n".join(found)


def ops() -> list[str]:
    """The names of the op table, without those the tape makes of others (crates/sdfrs-core/tests/fuse.rs)."""
    table = read(CORE / "op.rs").split("\nops! {")[1]
    table = re.sub(r"// What the tape makes of pairs.*?\n    \}", "", table, flags=re.S)
    return re.findall(r'^\s+\w+ "(\w+)" \(', table, re.M)


def expression_ops() -> set[str]:
    """The names formulas are made of: the table's scalar rows, and the point's coordinates."""
    scalar = read(CORE / "op.rs").split("\nops! {")[1].split("solid {")[0]
    names = set(re.findall(r'^\s+\w+ "(\w+)" \(', scalar, re.M))
    return names - {"length2", "length3"} | {"length", "x", "y", "z"}


def shapes() -> dict[str, list[str]]:
    """{name: arguments} of the shape registry."""
    table = read(CORE / "shape" / "kind.rs").split("\nkinds! {")[1].split("\n}")[0]
    rows = re.findall(r'^\s+\w+ "(\w+)" \[[^\]]*\] \{([^}]*)\}', table, re.M)
    found = {name: re.findall(r"(\w+):", fields) for name, fields in rows}
    return {**found, "texture": ["dims", "dtype", "lo", "hi", "data"]}


def tracers() -> dict[str, str]:
    """{name: variant} of the `Tracer` enum."""
    text = together("crates/sdfrs-trace/src/tracer/**/*.rs", "crates/sdfrs-trace/src/tracer*.rs")
    body = re.search(r"pub enum Tracer \{(.*?)\n\}", text, re.S)
    assert body, "no `pub enum Tracer` under crates/sdfrs-trace/src/tracer"
    variants = re.findall(r"^    (\w+) \{", re.sub(r"//[^\n]*", "", body[1]), re.M)
    return {re.sub(r"(?<!^)(?=[A-Z])", "_", variant).lower(): variant for variant in variants}


def rows(text: str) -> dict[str, str]:
    """{name: row} of the tables whose first column is one or more names in backquotes."""
    found = {}
    for line in text.splitlines():
        if line.startswith("| `"):
            found.update(dict.fromkeys(re.findall(r"`(\w+)`", line.split("|")[1]), line))
    return found


def test_every_op_has_a_test_that_names_it() -> None:
    forgotten = [name for name in ops() if not re.search(rf'^    "{name}": ', read("tests/python/test_ops.py"), re.M)]
    traced = re.findall(r'"(\w+)": \(', read("tests/python/test_ops.py").split("\nTRACED = ")[1].splitlines()[0])
    forgotten = sorted(set(forgotten) - set(traced))
    assert not forgotten, (
        f"no row of tests/python/test_ops.py is named {forgotten} (CONTRIBUTING.md, add an op, step 2)"
    )


def test_every_expression_op_is_in_python_and_the_docs() -> None:
    python, documented = together("python/sdfrs/*.py"), rows(read("docs/scene-format.md"))
    for name in sorted(expression_ops()):
        assert name in documented, f"`{name}` has no row in docs/scene-format.md (CONTRIBUTING.md, add an op, step 4)"
        assert f'"{name}"' in python, f"no module of python/sdfrs builds `{name}` (CONTRIBUTING.md, add an op, step 3)"


@pytest.mark.parametrize("name", sorted(shapes()))
def test_every_shape_is_in_python_the_docs_and_the_tests(name: str) -> None:
    recipe = "CONTRIBUTING.md, add a shape"
    assert f'"{name}"' in together("python/sdfrs/*.py"), f"no function or method builds `{name}` ({recipe}, step 3)"
    row = rows(read("docs/scene-format.md")).get(name, "")
    text = row or next((line for line in read("docs/scene-format.md").splitlines() if line.startswith(f"`{name}`")), "")
    text += (
        read("docs/scene-format.md").split("### Formulas")[1].split("###")[0] if name in ("formula", "const") else ""
    )
    assert text, f"`{name}` has no row in docs/scene-format.md ({recipe}, step 4)"
    for argument in shapes()[name]:
        assert f"`{argument}`" in text, f"docs/scene-format.md: `{name}` lacks `{argument}` ({recipe}, step 4)"
    assert f'"{name}"' in rust_tests() + together("tests/python/*.py"), f"no test names `{name}` ({recipe}, step 5)"


def test_the_docs_name_no_shape_that_is_gone() -> None:
    listed = set(rows(read("docs/scene-format.md").split("## Nodes")[1].split("## What is refused")[0]))
    assert listed <= set(shapes()) | expression_ops(), sorted(listed - set(shapes()) - expression_ops())


@pytest.mark.parametrize("name", sorted(tracers()))
def test_every_tracer_is_registered_everywhere(name: str) -> None:
    import sdfrs
    from sdfrs.tracers import TRACERS

    recipe, variant = "CONTRIBUTING.md, add a tracer", tracers()[name]
    assert name in TRACERS and getattr(sdfrs, variant, None) is TRACERS[name], f"sdfrs.{variant} ({recipe}, step 3)"
    assert variant in sdfrs.__all__, f"`{variant}` is not in sdfrs.__all__ ({recipe}, step 3)"
    assert re.search(rf"\b{variant} \{{", together("tests/laws/*.rs")), f"no law runs `{variant}` ({recipe}, step 4)"
    assert f'"{name}"' in together("tests/python/oracle/*.py"), f"no independent `{name}` ({recipe}, step 4)"
    row = rows(read("docs/tracers.md")).get(name, "")
    assert f"`{variant}`" in row, f"`{name}` has no row in docs/tracers.md ({recipe}, step 5)"
    parameters = [field for field in TRACERS[name].__dataclass_fields__ if field not in ("name", "form", "guards")]
    for parameter in parameters:
        assert f"`{parameter}`" in row, f"docs/tracers.md: `{name}` lacks `{parameter}` ({recipe}, step 5)"
    for form in re.findall(r'"(\w+)"', str(TRACERS[name].__annotations__.get("form", ""))):
        assert f'`"{form}"`' in row, f'docs/tracers.md: `{name}` lacks the form "{form}" ({recipe}, step 5)'
    assert f"sdfrs.{variant}(" in read("examples/demo.py"), f"the demo leaves out {variant} ({recipe}, step 5)"


def test_the_recipes_are_there() -> None:
    assert re.findall(r"^## Recipe: (.*)", read("CONTRIBUTING.md"), re.M) == [
        "add an op",
        "add a tracer",
        "add a shape",
    ]


@pytest.mark.parametrize("text", TEXTS)
def test_paths_in_the_texts_exist(text: str) -> None:
    named = re.findall(
        r"`((?:crates|python|tests|docs|examples|tools|shaders)/[\w./-]*|[\w-]+\.(?:py|md|toml))`", read(text)
    )
    named += re.findall(r"\]\(([\w./-]+)\)", read(text))
    missing = [
        path for path in named if not (ROOT / path).exists() and not (ROOT / text).parent.joinpath(path).exists()
    ]
    assert not missing, f"{text} names {missing}, which do not exist"


def test_readme_runs_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    snippet = re.findall(r"```python\n(.*?)```", read("README.md"), re.S)[0]
    exec(compile(snippet.replace("width=960, height=540", "width=64, height=36"), "README.md", "exec"), {})
    assert (tmp_path / "first_light.png").stat().st_size > 500


def test_tracers_page_runs_as_printed() -> None:
    found: dict[str, object] = {}
    for snippet in re.findall(r"```python\n(.*?)```", read("docs/tracers.md"), re.S):
        exec(compile(snippet, "docs/tracers.md", "exec"), found)
    assert "hits" in found


def test_the_printed_scene_loads(tmp_path: Path) -> None:
    import sdfrs

    printed = re.findall(r"```json\n(.*?)```", read("docs/scene-format.md"), re.S)[0]
    (tmp_path / "scene.json").write_text(printed, encoding="utf-8")
    scene = sdfrs.load(tmp_path / "scene.json")
    assert scene.camera is not None and scene.camera.width == json.loads(printed)["camera"]["width"]


def test_readme_names_the_example_scenes() -> None:
    from sdfrs import scenes

    listed = re.findall(r"`(\w+)`", read("README.md").split("named scenes that work")[1].split("- **")[0])
    assert set(listed) == set(scenes.NAMES)


def test_stubs_name_what_the_bindings_have() -> None:
    """`python3 dev.py lint` compares the whole file with a fresh one; this is the quick half."""
    from sdfrs import _core

    tree = ast.parse(read("python/sdfrs/_core.pyi"))
    stubbed: set[str] = set()
    for node in tree.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            stubbed.add(node.name)
        elif isinstance(node, (ast.AnnAssign, ast.Assign)):
            targets = [node.target] if isinstance(node, ast.AnnAssign) else node.targets
            stubbed |= {target.id for target in targets if isinstance(target, ast.Name)}
    there = {name for name in dir(_core) if not name.startswith("__")} | {"__version__"}
    assert there - stubbed == set() and stubbed - set(dir(_core)) <= {"__all__"}, "run `python3 dev.py stubs`"


def length(file: Path) -> int:
    """Lines of a file; docstrings don't count, their examples are the manual."""
    text = file.read_text(encoding="utf-8")
    lines = len(text.splitlines())
    if file.suffix == ".py":
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None:
                lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
    return lines


def test_files_stay_readable() -> None:
    patterns = ("crates/**/*.rs", "tests/**/*.rs", "python/**/*.py", "tests/**/*.py", "*.py", "tools/*.py")
    files = [file for pattern in patterns for file in ROOT.glob(pattern) if "target" not in file.parts]
    long = {str(file.relative_to(ROOT)): length(file) for file in files if length(file) > LONGEST}
    assert not long, f"longer than {LONGEST} lines, split them: {long}"


def test_dev_lists_its_commands() -> None:
    listed = subprocess.run([sys.executable, "-I", ROOT / "dev.py"], capture_output=True, text=True, check=True).stdout
    for command in ("demo", "test", "lint", "format", "stubs", "gallery", "doctor", "package"):
        assert re.search(rf"^ +{command} ", listed, re.M), command
