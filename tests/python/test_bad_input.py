"""Whatever is wrong is one typed error that says what was asked, got and allowed; never a crash or a wrong picture."""

import math
import resource
import subprocess
import sys

import numpy as np
import pytest

import sdfrs

NAN, INF = math.nan, math.inf
BALL = sdfrs.sphere(1)
O, D = np.array([[0.0, 0, 3]]), np.array([[0.0, 0, -1]])
ONES = np.ones((2, 2, 2), np.float32)
CORNERS = ((0, 0, 0), (1, 1, 1))


def camera(**changes):
    return sdfrs.Camera.look_at(**{"origin": (0, 0, 5), "width": 8, "height": 8, **changes})


def trace(o=O, d=D, **settings):
    return sdfrs.trace(BALL, o, d, **settings)


# what is asked: (call, words that the message must hold)
SCENE_ERRORS = {
    "negative radius": (lambda: sdfrs.sphere(-1), ["sphere", "radius", "-1"]),
    "zero radius": (lambda: sdfrs.sphere(0), ["sphere", "radius"]),
    "nan radius": (lambda: sdfrs.sphere(NAN), ["sphere", "radius", "nan"]),
    "infinite radius": (lambda: sdfrs.sphere(INF), ["sphere", "radius", "inf"]),
    "radius beyond floats": (lambda: sdfrs.sphere(10**400), ["sphere", "radius"]),
    "radius too large to square": (lambda: sdfrs.sphere(1e200), ["sphere", "radius"]),
    "nan center": (lambda: sdfrs.sphere(1, center=(0, NAN, 0)), ["center", "nan"]),
    "negative size": (lambda: sdfrs.box((1, -1, 1)), ["box", "size"]),
    "two sizes": (lambda: sdfrs.box((1, 1)), ["box", "three"]),
    "rounding too large": (lambda: sdfrs.rounded_box((1, 1, 1), 0.6), ["rounded_box", "radius", "0.6", "0.5"]),
    "negative tube": (lambda: sdfrs.torus(1, -0.1), ["torus", "minor"]),
    "flat cylinder": (lambda: sdfrs.cylinder(1, height=0), ["cylinder", "height"]),
    "pointless cone": (lambda: sdfrs.cone(0, 1), ["cone", "radius"]),
    "ellipsoid": (lambda: sdfrs.ellipsoid((1, 0, 1)), ["ellipsoid", "radii"]),
    "zero normal": (lambda: sdfrs.plane((0, 0, 0)), ["plane", "normal", "zero"]),
    "gyroid period": (lambda: sdfrs.gyroid(0, 0.1), ["gyroid", "period"]),
    "mandelbulb power": (lambda: sdfrs.mandelbulb(99), ["mandelbulb", "power", "99"]),
    "mandelbulb iterations": (lambda: sdfrs.mandelbulb(8, 0), ["mandelbulb", "iterations"]),
    "negative k": (lambda: BALL.union(BALL, k=-0.1), ["union", "k", "-0.1"]),
    "negative k of an intersection": (lambda: BALL.intersection(BALL, k=-1), ["intersection", "k"]),
    "nan k": (lambda: BALL.difference(BALL, k=NAN), ["difference", "k", "nan"]),
    "union of nothing": (lambda: sdfrs.union(), ["union", "at least one"]),
    "difference of nothing": (lambda: BALL.difference(), ["difference", "at least one"]),
    "infinite offset": (lambda: BALL.translate((0, 0, INF)), ["translate", "offset", "inf"]),
    "zero axis": (lambda: BALL.rotate(1, axis=(0, 0, 0)), ["rotate", "axis", "zero"]),
    "zero orientation": (lambda: BALL.orient((0, 0, 0)), ["orient", "axis"]),
    "zero scale": (lambda: BALL.scale(0), ["scale", "factor"]),
    "negative scale": (lambda: BALL.scale((1, -1, 1)), ["scale", "factor"]),
    "negative period": (lambda: BALL.repeat((-1, 0, 0)), ["repeat", "period"]),
    "no period": (lambda: BALL.repeat((0, 0, 0)), ["repeat", "period"]),
    "negative count": (lambda: BALL.repeat((4, 4, 4), -1), ["repeat", "count"]),
    "two counts": (lambda: BALL.repeat((4, 4, 4), (1, 1)), ["repeat", "count"]),
    "repeat of the unbounded": (lambda: sdfrs.plane().repeat((1, 1, 1)), ["repeat", "unbounded"]),
    "nan twist": (lambda: BALL.twist(NAN), ["twist", "rate"]),
    "nan bend": (lambda: BALL.bend(NAN), ["bend", "rate"]),
    "mirror": (lambda: BALL.mirror("w"), ["mirror", "axis", "'w'", "'x'"]),
    "negative shell": (lambda: BALL.shell(-1), ["shell", "thickness"]),
    "negative dilation": (lambda: BALL.dilate(-1), ["dilate", "radius"]),
    "negative erosion": (lambda: BALL.erode(-1), ["erode", "radius"]),
    "negative elongation": (lambda: BALL.elongate((-1, 0, 0)), ["elongate", "amount"]),
    "zero lipschitz": (lambda: BALL.with_lipschitz(0), ["lipschitz"]),
    "bounds turned around": (lambda: BALL.with_bounds((1, 1, 1), (0, 0, 0)), ["bounds", "lo < hi"]),
    "points of two": (lambda: BALL(np.zeros((5, 2))), ["points", "(N, 3)", "(5, 2)"]),
    "one point": (lambda: BALL(np.zeros(3)), ["points", "(N, 3)", "(3,)"]),
    "ragged points": (lambda: BALL([[0, 0, 0], [1, 1]]), ["points"]),
    "nan points": (lambda: BALL([[0, 0, NAN]]), ["points", "nan", "2"]),
    "points beyond f32": (lambda: BALL([[0, 1e300, 0]]), ["points", "f32"]),
    "gradient of nan": (lambda: BALL.gradient([[0, 0, NAN]]), ["points"]),
    "precision": (lambda: BALL([[0, 0, 0]], precision="f16"), ["precision", "'f16'", "'f32'"]),
    "interval turned around": (lambda: BALL.interval((1, 0, 0), (0, 1, 1)), ["interval", "lo <= hi"]),
    "check of nothing": (lambda: BALL.check(samples=0), ["check", "samples"]),
    "texture of nan": (lambda: sdfrs.SdfTexture(ONES * np.float32(NAN), CORNERS), ["texture", "finite"]),
    "flat texture": (lambda: sdfrs.SdfTexture(ONES[:1], CORNERS), ["texture", "at least 2"]),
    "empty texture": (lambda: sdfrs.SdfTexture(np.zeros((0, 4, 4)), CORNERS), ["texture", "at least 2"]),
    "texture of two axes": (lambda: sdfrs.SdfTexture(np.ones((4, 4)), CORNERS), ["3-dimensional", "(4, 4)"]),
    "texture bounds": (lambda: sdfrs.SdfTexture(ONES, ((0, 0, 0), (1, 0, 1))), ["bounds", "lo < hi"]),
    "texture without bounds": (lambda: sdfrs.SdfTexture(ONES, 3), ["bounds", "pair"]),
    "omega below": (lambda: sdfrs.Relaxed(omega=0.99), ["relaxed", "omega", "[1, 2)", "0.99"]),
    "omega above": (lambda: sdfrs.Relaxed(omega=2), ["relaxed", "omega", "[1, 2)"]),
    "omega nan": (lambda: sdfrs.Relaxed(omega=NAN), ["relaxed", "omega"]),
    "omega of enhanced": (lambda: sdfrs.Enhanced(omega=0), ["enhanced", "omega", "(0, 1]"]),
    "beta 0": (lambda: sdfrs.AutoRelaxed(beta=0), ["auto_relaxed", "beta", "(0, 1)"]),
    "beta 1": (lambda: sdfrs.AutoRelaxed(beta=1), ["auto_relaxed", "beta", "(0, 1)"]),
    "form": (lambda: sdfrs.Relaxed(form="2024"), ["relaxed", "form", "'2024'", "'2018'"]),
    "search form": (lambda: sdfrs.BinarySearch(form="queue"), ["binary_search", "form", "'stack'"]),
    "search level": (lambda: sdfrs.BinarySearch(max_level=99), ["binary_search", "max_level"]),
    "unguarded coverage": (lambda: sdfrs.CoverageSearch(guards=False), ["coverage_search", "guards", "never"]),
    "tracer name": (lambda: trace(tracer="fast"), ["tracer", "'fast'", "'basic'"]),
    "eps 0": (lambda: trace(eps=0), ["eps", "> 0"]),
    "eps negative": (lambda: trace(eps=-1e-4), ["eps"]),
    "eps nan": (lambda: trace(eps=NAN), ["eps", "nan"]),
    "cone negative": (lambda: trace(cone=-1), ["cone"]),
    "no steps": (lambda: trace(max_steps=0), ["max_steps"]),
    "absurd steps": (lambda: trace(max_steps=10**20), ["max_steps"]),
    "zero direction": (lambda: trace(d=D * 0), ["direction", "unit length"]),
    "long direction": (lambda: trace(d=D * 2), ["direction", "unit length"]),
    "nan direction": (lambda: trace(d=D * NAN), ["directions", "nan"]),
    "infinite origin": (lambda: trace(o=O + INF), ["origins"]),
    "counts differ": (lambda: trace(o=np.zeros((2, 3))), ["origins", "directions", "2", "1"]),
    "flat origins": (lambda: trace(o=np.zeros(3)), ["origins", "(N, 3)"]),
    "t turned around": (lambda: trace(t_min=5, t_max=1), ["t_min"]),
    "t_max nan": (lambda: trace(t_max=NAN), ["t_max", "nan"]),
    "t_max infinite": (lambda: trace(t_max=INF), ["t_max", "inf"]),
    "t_max of other length": (lambda: trace(t_max=[1, 2]), ["t_max", "(1,)", "(2,)"]),
    "t_min holds nan": (lambda: trace(t_min=[NAN]), ["t_min", "nan"]),
    "empty image": (lambda: camera(width=0), ["width", "0", "65536"]),
    "negative image": (lambda: camera(height=-4), ["height"]),
    "wide image": (lambda: camera(width=10**9), ["width"]),
    "wider than u64": (lambda: camera(width=2**70), ["width"]),
    "huge image": (lambda: camera(width=65536, height=65536), ["65536"]),
    "resized to nothing": (lambda: camera().resized(0, 0), ["width"]),
    "image beyond the memory": (lambda: sdfrs.render(BALL, camera(width=46340, height=46340)), ["MiB", "memory"]),
    "stats beyond the memory": (lambda: sdfrs.trace_stats(BALL, camera(width=46340, height=46340)), ["MiB", "memory"]),
    "fov 0": (lambda: camera(fov=0), ["fov", "180"]),
    "fov 180": (lambda: camera(fov=180), ["fov", "180"]),
    "extent": (lambda: sdfrs.Camera.orthographic(extent=0), ["extent"]),
    "fov of a parallel camera": (lambda: sdfrs.Camera(kind="orthographic", fov=40), ["fov", "orthographic"]),
    "camera on its target": (lambda: camera(target=(0, 0, 5)), ["origin", "target"]),
    "up along the view": (lambda: camera(up=(0, 0, 1)), ["up"]),
    "no up": (lambda: camera(up=(0, 0, 0)), ["up"]),
    "nan camera": (lambda: camera(origin=(0, NAN, 0)), ["origin", "nan"]),
    "camera kind": (lambda: sdfrs.Camera(kind="fisheye"), ["kind", "'fisheye'"]),
    "light intensity": (lambda: sdfrs.PointLight((0, 0, 0), intensity=-1), ["intensity"]),
    "light colour": (lambda: sdfrs.PointLight((0, 0, 0), color=(1, -1, 0)), ["color"]),
    "light place": (lambda: sdfrs.PointLight((0, NAN, 0)), ["position", "nan"]),
    "background": (lambda: sdfrs.Scene(BALL, background=(0, 0, 2)), ["background", "[0, 1]"]),
    "t_max 0": (lambda: sdfrs.render(BALL, camera(), t_max=0), ["t_max"]),
    "render eps": (lambda: sdfrs.render(BALL, camera(), eps=0), ["eps"]),
    "render precision": (lambda: sdfrs.render(BALL, camera(), precision="f128"), ["precision"]),
    "heat map": (lambda: sdfrs.render(BALL, camera()).heatmap("speed"), ["heatmap", "'speed'", "'steps'"]),
    "heat map scale": (lambda: sdfrs.render(BALL, camera()).heatmap("steps", vmax=0), ["vmax"]),
    "threads": (lambda: sdfrs.set_threads(-1), ["threads", "-1"]),
}  # fmt: skip

TYPE_ERRORS = {
    "text radius": lambda: sdfrs.sphere("1"),
    "bool radius": lambda: sdfrs.sphere(True),
    "no radius": lambda: sdfrs.sphere(None),
    "complex radius": lambda: sdfrs.sphere(1j),
    "text size": lambda: sdfrs.box("abc"),
    "number as vector": lambda: BALL.translate(1),
    "float power": lambda: sdfrs.mandelbulb(8.5),
    "union with a number": lambda: BALL | 1,
    "union of numbers": lambda: sdfrs.union(1, 2),
    "difference with a number": lambda: sdfrs.difference(BALL, 1),
    "intersection with nothing": lambda: BALL & None,
    "complex points": lambda: BALL(np.zeros((2, 3), complex)),
    "text points": lambda: BALL([["a", "b", "c"]]),
    "object points": lambda: BALL(np.array([[None, 1, 2]])),
    "bool points": lambda: BALL(np.zeros((2, 3), bool)),
    "integer texture": lambda: sdfrs.SdfTexture(np.ones((2, 2, 2), int), CORNERS),
    "complex texture": lambda: sdfrs.SdfTexture(np.ones((2, 2, 2), complex), CORNERS),
    "swapped texture": lambda: sdfrs.SdfTexture(np.ones((2, 2, 2), ">f4" if sys.byteorder == "little" else "<f4"), CORNERS),
    "shape of nothing": lambda: sdfrs.shape(3),
    "displaced by a number": lambda: BALL.displace(3),
    "tracer class": lambda: trace(tracer=sdfrs.Basic),
    "tracer number": lambda: trace(tracer=3),
    "guards": lambda: sdfrs.Basic(guards="no"),
    "steps as float": lambda: trace(max_steps=10.0),
    "eps as text": lambda: trace(eps="small"),
    "t_max as text": lambda: trace(t_max="far"),
    "rendering a number": lambda: sdfrs.render(3),
    "rendering with a scene as camera": lambda: sdfrs.render(BALL, sdfrs.Scene(BALL)),
    "lights of numbers": lambda: sdfrs.render(BALL, camera(), lights=[1]),
    "scene of a number": lambda: sdfrs.Scene(3),
    "progress": lambda: sdfrs.render(BALL, camera(), progress="yes"),
    "third positional": lambda: sdfrs.render(BALL, camera(), "basic"),
    "unknown keyword": lambda: sdfrs.render(BALL, camera(), omega=1.5),
    "device": lambda: sdfrs.render(BALL, camera(), device=3),
    "camera size": lambda: camera(width=8.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENE_ERRORS)
def test_values_out_of_range_are_scene_errors(name):
    call, words = SCENE_ERRORS[name]
    with pytest.raises(sdfrs.SceneError) as caught:
        call()
    message = str(caught.value)
    assert isinstance(caught.value, (sdfrs.Error, ValueError)) and len(message) < 400
    for word in words:
        assert word in message, message


@pytest.mark.parametrize("name", TYPE_ERRORS)
def test_wrong_types_are_type_errors(name):
    with pytest.raises(TypeError) as caught:
        TYPE_ERRORS[name]()
    assert len(str(caught.value)) < 500


def test_right_input_passes():
    """The same calls with good values: the tables above must not pass because everything fails."""
    sdfrs.sphere(np.float32(1)), sdfrs.box(np.array([1, 2, 3])), BALL(np.zeros((0, 3))), BALL([[1, 2, 3]])
    assert trace().status.tolist() == [1]
    assert trace(o=O.astype(np.float32), d=(D * 1.0005).tolist(), t_max=np.array([50])).status.tolist() == [1]
    assert sdfrs.render(BALL, camera(), lights=[], t_max=10).hit.any()
    assert BALL(np.asfortranarray(np.ones((4, 3)))).shape == BALL(np.ones((8, 3))[::2]).shape == (4,)


@pytest.mark.parametrize("call", [sdfrs.render, sdfrs.trace_stats], ids=["render", "stats"])
def test_missing_devices_say_what_there_is(call):
    for device in ("gpu:98", "cuda"):
        with pytest.raises(sdfrs.DeviceError) as caught:
            call(BALL, camera(), device=device)
        assert device[-2:] in str(caught.value) and isinstance(caught.value, RuntimeError)
    with pytest.raises(sdfrs.DeviceError):
        trace(device="gpu:98")


def test_refused_images_allocate_nothing():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(sdfrs.SceneError):
        sdfrs.render(BALL, camera(width=46340, height=46340))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # KiB


def test_the_errors_have_one_base():
    for cls, other in (("SceneError", ValueError), ("FormatError", ValueError), ("DeviceError", RuntimeError)):
        error = getattr(sdfrs, cls)
        assert issubclass(error, sdfrs.Error) and issubclass(error, other) and error.__module__ == "sdfrs"


def test_deep_scenes_end_neither_the_stack_nor_the_process():
    code = (
        "import sdfrs, threading\n"
        "threading.stack_size(256 * 1024)\n"
        "def work():\n"
        "    s = sdfrs.sphere(1)\n"
        "    for i in range(100_000): s = s.dilate(1e-6).negate() if i % 2 else -(s | s)\n"
        "    s([[0, 0, 3]]); s.gradient([[0, 0, 3]]); s.interval((0, 0, 0), (1, 1, 1)); repr(s); s.lipschitz\n"
        "    import pickle; pickle.loads(pickle.dumps(s))\n"
        "    print('done')\n"
        "t = threading.Thread(target=work); t.start(); t.join()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stdout == "done\n", done.stderr[-500:]
