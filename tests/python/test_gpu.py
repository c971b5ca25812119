"""The GPU against the CPU: the same rays, counts, pictures and errors, on whatever adapter there is.

Without one these tests are left out, and say so; SDFRS_REQUIRE_GPU=1 makes that a failure. Mesa's lavapipe is
enough (Debian: apt install mesa-vulkan-drivers libvulkan1).
"""

import json
import os
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest

import sdfrs
from sdfrs.cli import main

EPS = 1e-4
TRACERS = ["basic", "relaxed", "enhanced", "auto_relaxed", "binary_search", "coverage_search"]
SIZE = (96, 64)
# Drivers in software take seconds to compile the largest scene.
PAIRS = [
    (scene, tracer)
    for scene in sorted(sdfrs.scenes.NAMES)
    for tracer in TRACERS
    if scene != "composition" or tracer in ("enhanced", "auto_relaxed", "coverage_search")
]


@pytest.fixture(scope="session", autouse=True)
def gpu():
    """The words of the adapter, or why there is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=8), device="gpu")
    except sdfrs.DeviceError as error:
        if os.environ.get("SDFRS_REQUIRE_GPU") == "1":
            pytest.fail(f"SDFRS_REQUIRE_GPU=1, but {error}")
        pytest.skip(f"left out: {error}")
    return image.device


pytestmark = pytest.mark.filterwarnings("ignore:gpu .*runs on the processor:UserWarning")


def small(name):
    scene = sdfrs.load(name)
    return scene, scene.camera.resized(*SIZE)


def near_edges(status, depth):
    """Pixels with a neighbour (of 8) that ended otherwise, or far in front or behind: silhouettes and creases."""
    edge = np.zeros(status.shape, bool)
    depth = np.where(np.isfinite(depth), depth, 1e9)
    padded, far = np.pad(status, 1, mode="edge"), np.pad(depth, 1, mode="edge")
    h, w = status.shape
    for dy in range(3):
        for dx in range(3):
            other, there = padded[dy : dy + h, dx : dx + w], far[dy : dy + h, dx : dx + w]
            edge |= (other != status) | (np.abs(there - depth) > 0.05 * depth)
    return edge


def differences(cpu, gpu):
    """Shares of pixels with the same status and steps, and those whose status or depth is off."""
    both = (cpu.status == 1) & (gpu.status == 1)
    with np.errstate(invalid="ignore"):
        deep = both & (np.abs(cpu.depth - gpu.depth) > 5 * EPS)
    off = (cpu.status != gpu.status) | deep
    return (cpu.status == gpu.status).mean(), (cpu.steps == gpu.steps).mean(), off


def close(cpu, gpu, tracer):
    same_status, same_steps, off = differences(cpu, gpu)
    least = 0.95 if tracer == "auto_relaxed" else 0.99
    return same_status >= 0.999 and same_steps >= least and off.mean() <= 0.001


@pytest.mark.parametrize(("scene", "tracer"), PAIRS)
def test_plain_mode_finds_what_the_cpu_finds(scene, tracer):
    what, cam = small(scene)
    settings = dict(tracer=tracer, max_steps=400)
    cpu = sdfrs.trace_stats(what, cam, device="cpu", **settings)
    gpu = sdfrs.trace_stats(what, cam, device="gpu", **settings)
    same_status, same_steps, off = differences(cpu, gpu)
    assert close(cpu, gpu, tracer), f"status {same_status:.5f}, steps {same_steps:.4f}, off {off.sum()}"
    lonely = off & ~near_edges(cpu.status, cpu.depth)
    assert not lonely.any(), f"pixels off the silhouettes differ: {np.argwhere(lonely)[:5].tolist()}"


def test_the_comparison_can_fail():
    what, cam = small("csg")
    cpu = sdfrs.trace_stats(what, cam, device="cpu", tracer="basic")
    grown = sdfrs.trace_stats(what.shape.dilate(0.002), cam, device="gpu", tracer="basic")
    assert not close(cpu, grown, "basic")
    assert (differences(cpu, grown)[2] & ~near_edges(cpu.status, cpu.depth)).any()


@pytest.mark.parametrize("tracer", TRACERS)
def test_strict_mode_has_the_bits_of_the_cpu(tracer):
    what, cam = small("csg")
    cpu = sdfrs.trace_stats(what, cam, device="cpu", tracer=tracer, prune="off")
    gpu = sdfrs.trace_stats(what, cam, device="gpu", tracer=tracer, strict=True)
    for name in ("status", "steps", "fallbacks", "depth", "multiplier", "flags"):
        assert np.array_equal(getattr(cpu, name), getattr(gpu, name), equal_nan=name == "multiplier"), name
    # The CPU also runs the ends of its packs.
    apart = {"seconds": 0, "node_evaluations": 0, "mean_ops": 0, "p50_ops": 0, "p99_ops": 0}
    assert {**vars(cpu.summary), **apart} == {**vars(gpu.summary), **apart}


@pytest.mark.parametrize("scene", ["csg", "village", "gyroid"])
def test_pictures_have_the_same_colours(scene):
    what, cam = small(scene)
    cpu = sdfrs.render(what, cam, device="cpu", prune="exact")
    gpu = sdfrs.render(what, cam, device="gpu")
    same = (cpu.status == gpu.status) & (np.abs(cpu.normals - gpu.normals).max(axis=2) < 0.02)
    off = np.abs(cpu.rgb.astype(int) - gpu.rgb.astype(int)).max(axis=2)
    assert same.mean() > 0.99 and off[same].max() <= 3 and (off[same] > 1).mean() < 0.01
    assert (off > 1)[~near_edges(cpu.status, cpu.depth)].mean() < 0.005
    strict = sdfrs.render(what, cam, device="gpu", strict=True)
    agree = (cpu.depth == strict.depth) & (cpu.normals == strict.normals).all(axis=2)
    assert agree.mean() > 0.5 and np.abs(cpu.rgb.astype(int) - strict.rgb.astype(int)).max(axis=2)[agree].max() <= 1


def test_lights_and_backgrounds_reach_the_gpu():
    cam = sdfrs.Camera.look_at((0, 0, 3), (0, 0, 0), fov=60, width=33, height=31)
    lamps = [sdfrs.PointLight((0, 2, 2), (1.0, 0.2, 0.0), 0.7), sdfrs.PointLight((-3, 0, 1), (0.0, 0.5, 1.0), 0.4)]
    for lights in (lamps, []):
        scene = sdfrs.Scene(sdfrs.sphere(), cam, lights, (0.1, 0.5, 0.9), (0.9, 0.7, 0.3))
        cpu, gpu = sdfrs.render(scene, device="cpu"), sdfrs.render(scene, device="gpu")
        inner = cpu.status == gpu.status
        assert np.abs(cpu.rgb.astype(int) - gpu.rgb.astype(int))[inner].max() <= 1 and inner.mean() > 0.995


def test_orthographic_cameras_and_odd_sizes():
    cam = sdfrs.Camera.orthographic((3, 2, 4), (0, 0, 0), extent=3.0, width=37, height=29)
    cpu, gpu = (sdfrs.trace_stats(sdfrs.sphere(1), cam, device=d, tracer="basic") for d in ("cpu", "gpu"))
    same_status, same_steps, off = differences(cpu, gpu)
    assert same_status == 1 and same_steps > 0.99 and not off.any() and {0, 1} == set(cpu.status.flat)


def test_pictures_of_several_tiles():
    """Coverage search keeps 256 bytes a ray: 900x600 pixels need more than one tile of 128 MiB."""
    cam = sdfrs.Camera.look_at((3, 2, 4), (0, 0, 0), fov=30, width=900, height=600)
    cpu = sdfrs.trace_stats(sdfrs.sphere(1), cam, device="cpu", tracer="coverage_search")
    gpu = sdfrs.trace_stats(sdfrs.sphere(1), cam, device="gpu", tracer="coverage_search")
    assert close(cpu, gpu, "coverage_search") and gpu.summary.rays == 540_000


def rays(n=500):
    random = np.random.default_rng(3)
    o = random.normal(size=(n, 3)).astype(np.float32) * 2
    d = -o + random.normal(size=(n, 3)) * 0.5
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)


def test_rays_of_their_own_ranges():
    o, d = rays()
    ends = dict(t_min=np.linspace(0, 1, len(o)), t_max=np.linspace(1.5, 9, len(o)))
    shape = sdfrs.box((1, 1.5, 2)) | sdfrs.sphere(0.8, center=(1, 0, 0))
    for tracer in TRACERS:
        cpu = sdfrs.trace(shape, o, d, tracer=tracer, device="cpu", **ends)
        gpu = sdfrs.trace(shape, o, d, tracer=tracer, device="gpu", strict=True, **ends)
        for name in ("t", "status", "steps", "fallbacks", "multiplier", "distance", "witness", "flags"):
            assert np.array_equal(getattr(cpu, name), getattr(gpu, name), equal_nan=True), (tracer, name)
    assert set(cpu.status.tolist()) == {0, 1} and (cpu.flags & 1).any() and "gpu" in gpu.device


@pytest.mark.parametrize("guards", [True, False])
def test_fields_that_are_no_numbers_are_invalid(guards):
    @sdfrs.shape(lipschitz=1.0)
    def half(p):
        return np.sqrt(p.x) - 1.0

    o, d = [[4.0, 0, 0], [-1, 0, 0], [0.5, 0, 0]], [[0, 1.0, 0], [0, 1, 0], [1, 0, 0]]
    for tracer in (sdfrs.Basic(guards), sdfrs.Enhanced(guards=guards), sdfrs.AutoRelaxed(guards=guards)):
        cpu, gpu = (sdfrs.trace(half, o, d, tracer=tracer, device=x, t_max=9, max_steps=50) for x in ("cpu", "gpu"))
        assert cpu.status.tolist() == gpu.status.tolist() and cpu.status[1] == 3
    picture = sdfrs.render(half, sdfrs.Camera.look_at((-3, 0, 0), (-4, 0, 0), width=4, height=4), device="gpu")
    assert (picture.rgb == (255, 0, 255)).all()


def test_textures_and_formulas_run_on_the_gpu(shapes):
    cam = sdfrs.Camera.look_at((3, 2, 4), (0, 0, 0), width=24, height=18)
    for name in ("texture", "formula", "gyroid", "mandelbulb", "repeat", "twist", "smooth_difference", "negate"):
        cpu, gpu = (sdfrs.trace_stats(shapes[name], cam, device=d, max_steps=200) for d in ("cpu", "gpu"))
        assert (cpu.status == gpu.status).mean() > 0.98, name


def test_the_device_says_what_it_is_and_why(gpu):
    camera = sdfrs.Camera.look_at(width=16, height=12)
    assert gpu.startswith("gpu ") and gpu.endswith("asked for")
    assert sdfrs.render(sdfrs.sphere(), camera, device="gpu:0").device == gpu
    assert sdfrs.trace_stats(sdfrs.sphere(), camera, device="gpu").settings.device == gpu
    words = sdfrs.render(sdfrs.sphere(), camera, device="cpu").device
    assert words.startswith("cpu (") and words.endswith("asked for")
    assert "few rays" in sdfrs.render(sdfrs.sphere(), camera).device


def test_auto_never_takes_software(gpu):
    words = sdfrs.trace_stats(sdfrs.sphere(), sdfrs.Camera.look_at(width=160, height=120)).settings.device
    if "software" in gpu:
        assert words.startswith("cpu (") and "asked for a real GPU" in words and "software" in words
    else:
        assert words.startswith("gpu ") and words.endswith("the first real GPU")


@pytest.mark.filterwarnings("error")
def test_software_warns(gpu):
    camera = sdfrs.Camera.look_at(width=8, height=8)
    o, d = [[0, 0, 3.0]], [[0, 0, -1.0]]
    calls = [
        lambda: sdfrs.render(sdfrs.sphere(), camera, device="gpu"),
        lambda: sdfrs.trace_stats(sdfrs.sphere(), camera, device="gpu"),
        lambda: sdfrs.trace(sdfrs.sphere(), o, d, device="gpu"),
    ]
    for call in calls:
        if "software" in gpu:
            with pytest.warns(UserWarning, match="runs on the processor") as caught:
                call()
            assert caught[0].filename == __file__
        else:
            call()


def test_what_cannot_be_had_is_a_device_error():
    camera = sdfrs.Camera.look_at(width=8, height=8)
    for device, words in (
        ("gpu:99", ["adapter 99", "0: "]),
        ("cuda", ['"cuda"', "allowed", "gpu:N"]),
        ("gpu:x", ['"gpu:x"']),
        ("", ['""']),
    ):
        with pytest.raises(sdfrs.DeviceError) as caught:
            sdfrs.render(sdfrs.sphere(), camera, device=device)
        assert all(word in str(caught.value) for word in words), str(caught.value)
    for call in (sdfrs.render, sdfrs.trace_stats):
        with pytest.raises(sdfrs.DeviceError, match="f32"):
            call(sdfrs.sphere(), camera, device="gpu", precision="f64")
    assert "f64" in sdfrs.render(sdfrs.sphere(), camera, precision="f64").device
    with pytest.raises(TypeError, match="strict"):
        sdfrs.render(sdfrs.sphere(), camera, strict=1)


def test_scenes_too_long_to_compile_are_interpreted():
    parts = [
        sdfrs.box(0.1 + 0.0001 * i).rotate(0.001 * i).translate((i % 30 * 0.2, i // 30 * 0.2, 0)) for i in range(900)
    ]
    many, cam = sdfrs.union(*parts), sdfrs.Camera.look_at((3, 3, 9), (3, 3, 0), width=32, height=24)
    cpu, gpu = (sdfrs.trace_stats(many, cam, device=d, tracer="basic", max_steps=60) for d in ("cpu", "gpu"))
    assert close(cpu, gpu, "basic") and {0, 1} <= set(cpu.status.flat)


def test_no_driver_is_a_clean_error():
    code = (
        "import sdfrs\n"
        "cam = sdfrs.Camera.look_at(width=160, height=120)\n"
        "print(sdfrs.render(sdfrs.sphere(), cam).device)\n"
        "try:\n    sdfrs.render(sdfrs.sphere(), cam, device='gpu')\n"
        "except sdfrs.DeviceError as e:\n    print(e)\n"
    )
    env = {**os.environ, "VK_DRIVER_FILES": os.devnull, "VK_ICD_FILENAMES": os.devnull}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    if "found none" in done.stdout:  # elsewhere drivers are found by other means
        assert "cpu (" in done.stdout and "driver" in done.stdout


FORK = """
import os, signal, sys, warnings
import sdfrs
warnings.simplefilter("ignore")
cam = sdfrs.Camera.look_at(width=160, height=120)
sdfrs.render(sdfrs.sphere(), cam, device="gpu")
child = os.fork()
if child == 0:
    signal.alarm(20)
    try:
        sdfrs.render(sdfrs.sphere(), cam, device="gpu")
        os._exit(3)
    except sdfrs.DeviceError as error:
        text = str(error)
    auto = sdfrs.render(sdfrs.sphere(), cam)
    os._exit(0 if "fork" in text and auto.hit.any() and auto.device.startswith("cpu") else 4)
code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
again = sdfrs.render(sdfrs.sphere(), cam, device="gpu")
sys.exit(code if again.hit.any() else 5)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_after_a_render_gets_an_error_and_never_hangs():
    done = subprocess.run([sys.executable, "-c", FORK], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, (done.returncode, done.stderr)


def test_threads_share_the_gpu():
    what, cam = small("csg")
    want = sdfrs.trace_stats(what, cam, device="gpu", tracer="basic").steps
    seen, faults = [], []

    def work():
        try:
            for _ in range(3):
                seen.append(sdfrs.trace_stats(what, cam, device="gpu", tracer="basic").steps)
        except Exception as error:
            faults.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert not faults and len(seen) == 12 and all(np.array_equal(steps, want) for steps in seen)


def test_progress_ends_at_the_total():
    what, cam = small("csg")
    calls = []
    sdfrs.trace_stats(what, cam, device="gpu", progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (SIZE[0] * SIZE[1],) * 2 and calls == sorted(calls)


def test_a_progress_function_may_stop_the_gpu():
    what = sdfrs.load("mandelbulb")

    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sdfrs.trace_stats(what, what.camera.resized(640, 360), device="gpu", progress=stop)
    again = sdfrs.trace_stats(*small("csg"), device="gpu", strict=True, tracer="basic")
    assert np.array_equal(again.steps, sdfrs.trace_stats(*small("csg"), device="cpu", tracer="basic").steps)


def test_doctor_lists_the_gpus(capsys, gpu):
    assert main(["doctor", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["devices"][0] == "cpu" and report["devices"][1].startswith("gpu:0 ")
    assert "MiB" in report["devices"][1]
    if "software" in gpu:
        assert any("real GPU" in line for line in report["missing"])
    assert main(["doctor"]) == 0
    assert "gpu:0 " in capsys.readouterr().out


def test_the_command_line_names_devices(tmp_path, capsys):
    out = str(tmp_path / "a.png")
    assert (
        main(["render", "csg", "--size", "32x18", "--device", "gpu", "--strict", "--json", "-o", out, "--quiet"]) == 0
    )
    assert "gpu " in json.loads(capsys.readouterr().out)["device"] and os.path.getsize(out) > 0
    assert main(["render", "csg", "--size", "32x18", "--device", "gpu:77", "-o", out, "--quiet"]) == 1
    assert "adapter 77" in capsys.readouterr().err


def test_pruning_is_honoured_and_reported():
    what, cam = small("spheres1000")
    whole, exact, skip = (
        sdfrs.trace_stats(what, cam, device="gpu", strict=True, tracer="enhanced", prune=prune)
        for prune in ("off", "exact", "skip")
    )
    assert (whole.summary.prune, exact.summary.prune, skip.summary.prune) == ("off", "exact", "skip")
    for name in ("status", "steps", "fallbacks", "depth", "multiplier", "flags"):
        assert np.array_equal(getattr(whole, name), getattr(exact, name), equal_nan=name == "multiplier"), name
    assert (skip.status == whole.status).mean() >= 0.999
    assert skip.summary.mean_steps < 0.9 * exact.summary.mean_steps
    assert max(skip.summary.mean_ops, exact.summary.mean_ops) < 0.9 * whole.summary.mean_ops == 900
    assert skip.summary.arena_bytes > 0 == whole.summary.arena_bytes
    assert skip.summary.node_evaluations < 0.9 * exact.summary.node_evaluations < 0.9 * whole.summary.node_evaluations
    auto = sdfrs.trace_stats(*small("csg"), device="gpu")
    assert auto.summary.prune == "off"  # straight lines are faster


@pytest.mark.parametrize("sparse", [False, True])
def test_voxels_are_walked_as_on_the_cpu(sparse):
    ball = sdfrs.sphere(0.7) - sdfrs.box(0.6).translate((0.4, 0.4, 0.4))
    settings = dict(bounds=((-1, -1, -1), (1, 1, 1)), stepping="voxel")
    texture = ball.to_texture(40, **settings, **({"sparse": True, "band": 0.2} if sparse else {}))
    cam = sdfrs.Camera.look_at((2, 1.5, 2.5), (0, 0, 0), width=96, height=64)
    cpu = sdfrs.trace_stats(texture, cam, device="cpu")
    strict = sdfrs.trace_stats(texture, cam, device="gpu", strict=True)
    for name in ("status", "steps", "depth"):
        assert np.array_equal(getattr(cpu, name), getattr(strict, name)), name
    plain = sdfrs.trace_stats(texture, cam, device="gpu")
    assert close(cpu, plain, "basic") and {0, 1} == set(cpu.status.flat)
    bricks = sdfrs.trace_stats(ball.to_texture(40, **{**settings, "stepping": "bricks"}), cam, device="cpu")
    assert not close(bricks, plain, "basic")
