"""Every public name has a docstring with an example that runs; importing stays light."""

import doctest
import importlib
import inspect
import pkgutil
import subprocess
import sys

import pytest

import sdfrs

MODULES = sorted(m.name for m in pkgutil.iter_modules(sdfrs.__path__) if m.name not in ("_core", "__main__"))


def public():
    """(name, object) of every public function, class, method and property."""
    for name in sdfrs.__all__:
        thing = getattr(sdfrs, name)
        if inspect.ismodule(thing):
            continue
        yield name, thing
        if inspect.isclass(thing):
            for key, value in vars(thing).items():
                if not key.startswith("_") and (
                    callable(value) or isinstance(value, (property, classmethod, staticmethod))
                ):
                    if getattr(value, "__doc__", None) or not inspect.isclass(value):
                        yield f"{name}.{key}", getattr(value, "__func__", value)


NAMES = dict(public())


@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module):
    found = doctest.testmod(importlib.import_module(f"sdfrs.{module}"), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0


def test_the_examples_are_found():
    count = sum(
        len(t.examples) for m in MODULES for t in doctest.DocTestFinder().find(importlib.import_module(f"sdfrs.{m}"))
    )
    assert count > 150 and len(NAMES) > 80


# Expr's one method is what np.clip calls; operators have their example at the class.
@pytest.mark.parametrize("name", [n for n in NAMES if not n.startswith("Expr.")])
def test_every_public_name_has_an_example(name):
    text = inspect.getdoc(NAMES[name]) or ""
    first = text.split("\n")[0]
    assert first.endswith((".", ":")) or "\n" in text, f"{name}: the first line must be a sentence"
    assert "Examples:" in text and ">>> " in text, f"{name}: no example"


def test_all_is_all():
    names = {n for n, v in vars(sdfrs).items() if not n.startswith("_") and not (inspect.ismodule(v) and n != "scenes")}
    assert names == set(sdfrs.__all__)


def test_named_scenes_have_one_line_each():
    for scene in sdfrs.scenes.NAMES.values():
        assert inspect.getdoc(scene).split("\n")[0].endswith(".") and ">>> " in inspect.getdoc(scene)


def test_importing_loads_little_more_than_numpy():
    code = "import sys, numpy; before = set(sys.modules); import sdfrs; print(*sorted(set(sys.modules) - before))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    heavy = {"PIL", "json", "argparse", "tqdm", "matplotlib", "base64", "html.entities", "importlib.metadata"}
    assert not heavy & set(loaded), loaded
    # Each module costs a fraction of a millisecond; times themselves would only measure the machine.
    assert len(loaded) < 80, loaded
