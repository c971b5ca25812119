"""The command line: what it writes, prints, and exits with."""

import json
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import sdfrs
from sdfrs.cli import main


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


SMALL = ["--size", "64x36"]


def test_render_writes_what_the_function_renders(here, capsys):
    assert main(["render", "csg", "-o", "a.png", "--tracer", "enhanced", *SMALL]) == 0
    scene = sdfrs.load("csg")
    want = sdfrs.render(scene, scene.camera.resized(64, 36), tracer="enhanced")
    np.testing.assert_array_equal(np.asarray(Image.open("a.png")), want.rgb)
    out = capsys.readouterr()
    assert "a.png" in out.out and out.err == ""


def test_render_takes_files_and_names_its_output_after_them(here):
    sdfrs.Scene(sdfrs.sphere(1)).save("ball.json")
    assert main(["render", "ball.json", *SMALL]) == 0
    assert Image.open("ball.png").size == (64, 36)
    assert sorted(p.name for p in here.iterdir()) == ["ball.json", "ball.png"]


def test_render_maps_and_json(here, capsys):
    command = ["render", "csg", "-o", "a.png", "--heatmap", "steps", "--heatmap", "depth", "--json", *SMALL]
    assert main([*command, "--precision", "f64", "--eps", "1e-5", "--max-steps", "77", "--t-max", "50"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["files"] == {"rgb": "a.png", "steps": "a-steps.png", "depth": "a-depth.png"}
    assert report["summary"]["rays"] == 64 * 36 and report["summary"]["max_steps"] <= 77
    assert report["trace_seconds"] >= 0 and "cpu" in report["device"]
    assert Image.open("a-steps.png").width >= 64


def test_stats_print_a_table_or_json(capsys):
    two = ["--tracer", "basic", "--tracer", "relaxed:omega=1.2,form=2018,guards=false"]
    assert main(["stats", "csg", *two, *SMALL]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3 and lines[1].startswith("basic ")
    assert lines[2].startswith("relaxed:omega=1.2,form=2018,guards=False ")
    assert main(["stats", "csg", *two, "--json", *SMALL]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    scene = sdfrs.load("csg")
    want = sdfrs.trace_stats(scene, scene.camera.resized(64, 36), tracer="basic").summary
    assert runs[0]["summary"]["evaluations"] == want.evaluations
    assert runs[1]["tracer"] == "Relaxed(omega=1.2, form='2018', guards=False)"


def test_doctor_reports_and_says_what_is_missing(capsys, monkeypatch):
    assert main(["doctor", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sdfrs"] == sdfrs.__version__ and report["threads"] >= 1 and report["numpy"] == np.__version__
    assert report["instructions"] in ("baseline", "sse4.1", "avx2", "avx512", "neon")
    from importlib import metadata

    real = metadata.version

    def version(name):
        if name == "tqdm":
            raise metadata.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(metadata, "version", version)
    assert main(["doctor"]) == 0
    assert "pip install tqdm" in capsys.readouterr().out


USAGE = {
    "nothing": [],
    "unknown command": ["paint"],
    "no scene": ["render"],
    "unknown option": ["render", "csg", "--speed"],
    "unknown tracer": ["render", "csg", "--tracer", "fast"],
    "tracer parameter": ["render", "csg", "--tracer", "relaxed:beta=0.1"],
    "tracer value": ["render", "csg", "--tracer", "relaxed:omega=fast"],
    "tracer range": ["render", "csg", "--tracer", "relaxed:omega=2.5"],
    "tracer form": ["stats", "csg", "--tracer", "relaxed:form=1999"],
    "guards": ["stats", "csg", "--tracer", "basic:guards=perhaps"],
    "size": ["render", "csg", "--size", "big"],
    "negative size": ["render", "csg", "--size", "-4x4"],
    "precision": ["render", "csg", "--precision", "f16"],
    "heat map": ["render", "csg", "--heatmap", "speed"],
    "eps": ["render", "csg", "--eps", "small"],
}
FAILURES = {
    "no file": ["render", "nowhere.json"],
    "not a scene": ["render", "broken.json"],
    "device": ["render", "csg", "--device", "gpu:97", *SMALL],
    "eps": ["render", "csg", "--eps", "0", *SMALL],
    "empty": ["render", "csg", "--size", "0x0"],
    "huge": ["render", "csg", "--size", "99999x99999"],
    "ending": ["render", "csg", "-o", "a.xyz", *SMALL],
    "folder": ["render", "csg", "-o", "no/where/a.png", *SMALL],
    "threads": ["stats", "csg", "--threads", "-1", *SMALL],
}


@pytest.mark.parametrize("name", USAGE)
def test_wrong_usage_exits_with_2(name, here, capsys):
    assert main(USAGE[name]) == 2
    out = capsys.readouterr()
    assert out.out == "" and "usage" in out.err and list(here.iterdir()) == []


@pytest.mark.parametrize("name", FAILURES)
def test_failures_exit_with_1_and_one_line(name, here, capsys):
    (here / "broken.json").write_text("{")
    assert main(FAILURES[name]) == 1
    out = capsys.readouterr()
    assert out.out == "" and out.err.startswith("sdfrs: ") and out.err.count("\n") == 1
    assert [p.name for p in here.iterdir()] == ["broken.json"]


def test_warnings_are_one_line(here, capsys):
    sdfrs.Scene(sdfrs.sphere(500)).save("large.json")
    for size in ([], SMALL):
        assert main(["stats", "large.json", "--t-max", "100", *size]) == 0
        err = capsys.readouterr().err
        assert err.startswith("sdfrs: warning: t_max=100") and err.count("\n") == 1


def test_large_shapes_are_seen(here, capsys):
    sdfrs.sphere(500).to_texture(32).save("large.npz")
    for size in ([], SMALL):
        assert main(["render", "large.npz", *size]) == 0
        out = capsys.readouterr()
        assert out.err == "" and not out.out.split("\n")[1].startswith("0 hits")


def test_help_and_version_exit_with_0(capsys):
    for command in (["--help"], ["render", "--help"], ["--version"]):
        assert main(command) == 0
    out = capsys.readouterr().out
    assert "--tracer" in out and sdfrs.__version__ in out


def test_it_runs_as_a_module_and_survives_a_closed_pipe():
    command = [sys.executable, "-m", "sdfrs", "doctor"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "threads" in done.stdout
    piped = subprocess.run(
        f'"{sys.executable}" -m sdfrs doctor --json | true', shell=True, capture_output=True, text=True
    )
    assert "Traceback" not in piped.stderr
