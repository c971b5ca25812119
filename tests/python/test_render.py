"""Tracing and rendering against closed forms and against an independent tracer in plain Python."""

import math
import os
import subprocess
import sys
import warnings

import numpy as np
import pytest

import sdfrs

TRACERS = [
    sdfrs.Basic(), sdfrs.Relaxed(), sdfrs.Relaxed(form="2018"), sdfrs.Enhanced(), sdfrs.Enhanced(form="2018"),
    sdfrs.AutoRelaxed(), sdfrs.BinarySearch(), sdfrs.BinarySearch(form="stack"), sdfrs.BinarySearch(form="split"),
    sdfrs.CoverageSearch(),
]  # fmt: skip
IDS = [f"{t.name}-{getattr(t, 'form', '')}" for t in TRACERS]
every_tracer = pytest.mark.parametrize("tracer", TRACERS, ids=IDS)


def sphere_depth(o, d, radius):
    b = (o * d).sum(axis=1)
    root = b * b - (o * o).sum(axis=1) + radius**2
    return np.where(root >= 0, -b - np.sqrt(np.maximum(root, 0)), np.inf)


@every_tracer
@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_a_sphere_is_where_it_is(tracer, precision, camera):
    o, d = camera.rays()
    h = sdfrs.trace(sdfrs.sphere(1.0), o, d, tracer=tracer, precision=precision, eps=1e-5)
    want = sphere_depth(o, d, 1.0)
    clear = np.abs(np.linalg.norm(np.cross(o, d), axis=1) - 1) > 1e-3  # grazing rays may end either way
    np.testing.assert_array_equal(h.hit[clear], np.isfinite(want)[clear])
    both = h.hit & np.isfinite(want) & clear
    assert both.sum() > 100
    np.testing.assert_allclose(h.t[both], want[both], atol=2e-3)
    assert np.isinf(h.t[h.status == 0]).all() and np.isfinite(h.t[h.hit]).all()
    assert h.t.dtype == (np.float32 if precision == "f32" else np.float64)
    assert (h.status.dtype, h.steps.dtype, h.fallbacks.dtype) == (np.uint8, np.uint32, np.uint32)
    assert (h.distance[h.hit] <= 1e-5 + 1e-6).all()


@every_tracer
def test_counts_belong_together(tracer, camera):
    h = sdfrs.trace(sdfrs.load("csg").shape, *camera.rays(), tracer=tracer)
    s = h.summary
    assert s.rays == len(h.t) == s.hits + s.misses + s.out_of_steps + s.invalid
    assert s.hits == h.hit.sum() and s.evaluations == h.steps.sum() and s.fallbacks == h.fallbacks.sum()
    assert s.max_steps == h.steps.max() and s.mean_steps == pytest.approx(h.steps.mean())
    curve = h.active_rays
    assert len(curve) == h.steps.max() + 1
    assert curve.tolist() == [(h.steps > n).sum() for n in range(len(curve))]


def guarded(f, o, d, tracer, eps, t_max, max_steps):
    """TRACERS.md's guarded loop for one ray, f64: status, t, steps, fallbacks."""
    ulp = 2.0**-52
    steps = fallbacks = 0

    def value(t):
        nonlocal steps
        steps += 1
        return f(o + t * d)

    def threshold(t):
        p = o + t * d
        return max(eps, 4 * ulp * max(abs(t), math.sqrt(p @ p)))

    t, r = 0.0, value(0.0)
    if r <= threshold(t):
        return 1, t, steps, fallbacks
    name = tracer.name
    m = -1.0
    z = tracer.omega * r if name == "relaxed" else r
    while True:
        if t + r >= t_max:
            return 0, math.inf, steps, fallbacks
        if steps >= max_steps:
            return 2, t, steps, fallbacks
        T = min(t + z, t_max)
        dz = T - t
        basic = not z > r
        R = value(T)
        if basic or dz + 2 * ulp * max(abs(T), math.sqrt((o + T * d) @ (o + T * d))) <= r + R:
            M = min(max((R - r) / dz, -1.0), 0.9)
            m = m + tracer.beta * (M - m) if name == "auto_relaxed" else M
            t, r = T, R
            if r <= threshold(t):
                return 1, t, steps, fallbacks
            if t >= t_max:
                return 0, math.inf, steps, fallbacks
            if name == "basic":
                z = r
            elif name == "relaxed":
                z = tracer.omega * r
            elif name == "enhanced":
                z = r * (1 + tracer.omega * (1 + m) / (1 - m))
            else:
                z = r * max(1.0, 2 / (1 - m))
        else:
            z, m = r, -1.0
            fallbacks += 1


@pytest.mark.parametrize("tracer", [sdfrs.Basic(), sdfrs.Relaxed(), sdfrs.Enhanced(), sdfrs.AutoRelaxed()], ids=str)
def test_steps_on_a_grid_equal_an_independent_tracer(tracer):
    z, y, x = np.meshgrid(*[np.linspace(-1.5, 1.5, 25)] * 3, indexing="ij")
    exact = np.maximum(np.sqrt(x * x + y * y + z * z) - 1.0, 0.2 - np.abs(x - 0.3))
    field = sdfrs.SdfTexture(exact, bounds=((-1.5,) * 3, (1.5,) * 3)).with_lipschitz(1.0)
    o, d = sdfrs.Camera.look_at((2.5, 1.5, 3), (0, 0, 0), width=14, height=10).rays()
    d = d / np.sqrt(d[:, 0] ** 2 + d[:, 1] ** 2 + d[:, 2] ** 2)[:, None]
    h = sdfrs.trace(field, o, d, tracer=tracer, precision="f64", max_steps=200, t_max=10.0)
    f = lambda p: float(field(p[None, :], precision="f64")[0])  # noqa: E731
    mine = [guarded(f, a, b, tracer, 1e-4, 10.0, 200) for a, b in zip(o, d)]
    same = [
        (s, n, k) == (int(hs), int(hn), int(hk))
        for (s, _, n, k), hs, hn, hk in zip(mine, h.status, h.steps, h.fallbacks)
    ]
    # A sum rounded in another order may decide a test the other way, on a ray in a hundred at most.
    assert np.mean(same) >= 0.99, np.flatnonzero(~np.array(same))
    assert len({n for _, _, n, _ in mine}) > 3


def test_a_head_on_plane_takes_two_steps():
    h = sdfrs.trace(sdfrs.plane(), [[0, 3, 0]], [[0, -1, 0]], tracer="basic", precision="f64")
    assert h.steps.tolist() == [2] and h.t[0] == 3.0 and h.distance[0] == 0.0


def test_relaxed_by_one_is_basic(camera):
    shape = sdfrs.load("csg").shape
    a = sdfrs.trace(shape, *camera.rays(), tracer="basic")
    b = sdfrs.trace(shape, *camera.rays(), tracer=sdfrs.Relaxed(omega=1.0))
    np.testing.assert_array_equal(a.t, b.t)
    np.testing.assert_array_equal(a.steps, b.steps)


def test_spans_may_differ_from_ray_to_ray():
    o, d = np.zeros((3, 3)) + [0, 0, 5], np.zeros((3, 3)) - [0, 0, 1]
    h = sdfrs.trace(sdfrs.sphere(1), o, d, t_min=[0, 5.5, 0], t_max=[100, 100, 3.0], tracer="basic")
    assert h.status.tolist() == [1, 1, 0]
    assert h.t[0] == pytest.approx(4, abs=1e-3) and h.t[1] == 5.5  # starts inside
    assert h.flags.tolist() == [0, 1, 0] and h.summary.inside == 1
    assert sdfrs.trace(sdfrs.sphere(1), np.zeros((0, 3)), np.zeros((0, 3))).t.shape == (0,)


def test_budget_and_threshold():
    o, d = [[0, 0.3, 0]], [[0, -0.05, -math.sqrt(1 - 0.0025)]]
    few = sdfrs.trace(sdfrs.plane(), o, d, max_steps=5, tracer="basic")
    assert few.status.tolist() == [2] and few.steps.tolist() == [5] and few.summary.out_of_steps == 1
    fine = sdfrs.trace(sdfrs.plane(), o, d, eps=1e-6, tracer="basic", precision="f64")
    cone = sdfrs.trace(sdfrs.plane(), o, d, eps=1e-6, cone=1e-2, tracer="basic", precision="f64")
    assert cone.steps[0] < fine.steps[0] and cone.distance[0] <= 1e-2 * cone.t[0]


def test_bits_do_not_depend_on_threads():
    scene = sdfrs.load("csg")
    cam = scene.camera.resized(96, 54)
    try:
        sdfrs.set_threads(1)
        one = sdfrs.render(scene, cam)
        sdfrs.set_threads(3)
        many = sdfrs.render(scene, cam)
    finally:
        sdfrs.set_threads(0)
    for name in ("rgb", "depth", "normals", "steps", "fallbacks", "multiplier"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name), err_msg=name)
    assert one.settings.threads == 1 and many.settings.threads == 3


def test_threads_follow_the_environment():
    code = "import sdfrs; print(sdfrs.render(sdfrs.sphere(), sdfrs.Camera(width=8, height=8)).settings.threads)"
    env = {**os.environ, "SDFRS_THREADS": "3"}
    assert subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True).stdout == "3\n"


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_a_picture_is_what_the_light_says(precision):
    cam = sdfrs.Camera.look_at((0, 0, 5), (0, 0, 0), width=65, height=65)
    light = sdfrs.PointLight((0, 0, 50))
    scene = sdfrs.Scene(sdfrs.sphere(1), camera=cam, lights=[light], background=(0, 0.5, 1), albedo=(0.5, 0.5, 0.5))
    img = sdfrs.render(scene, precision=precision)
    assert img.rgb.shape == (65, 65, 3) and img.rgb.dtype == np.uint8
    assert img.rgb[0, 0].tolist() == [0, 128, 255] and not img.hit[0, 0] and np.isinf(img.depth[0, 0])
    # Facing the light head on: albedo * (0.15 + 0.85), encoded as sRGB.
    encoded = round(255 * (1.055 * 0.5 ** (1 / 2.4) - 0.055))
    assert abs(int(img.rgb[32, 32, 0]) - encoded) <= 1
    assert img.depth[32, 32] == pytest.approx(4, abs=1e-3)
    np.testing.assert_allclose(img.normals[32, 32], [0, 0, 1], atol=1e-2)
    np.testing.assert_allclose(np.linalg.norm(img.normals[img.hit], axis=1), 1, atol=1e-5)
    dark = sdfrs.render(scene, lights=[])
    assert dark.rgb[32, 32, 0] < img.rgb[32, 32, 0]


def test_row_zero_is_the_top_and_left_is_left():
    cam = sdfrs.Camera.look_at((0, 0, 5), (0, 0, 0), width=40, height=30)
    up = sdfrs.render(sdfrs.sphere(0.3, center=(-0.8, 1.0, 0)), cam)
    rows, columns = np.nonzero(up.hit)
    assert rows.max() < 15 and columns.max() < 20


def test_orthographic_pictures_do_not_shrink_with_distance():
    size = lambda z: sdfrs.render(  # noqa: E731
        sdfrs.sphere(1, center=(0, 0, z)), sdfrs.Camera.orthographic((0, 0, 5), extent=4, width=40, height=40)
    ).hit.sum()
    assert size(0) == size(-20) == pytest.approx(math.pi * 100, rel=0.05)


def test_camera_choice():
    cam = sdfrs.Camera.look_at((0, 0, 5), width=16, height=8)
    scene = sdfrs.Scene(sdfrs.sphere(1), camera=cam)
    assert sdfrs.render(scene).settings.camera is cam
    other = sdfrs.Camera.look_at((0, 0, 9), width=8, height=8)
    assert sdfrs.render(scene, other).settings.camera is other
    img = sdfrs.render(sdfrs.box((1, 3, 2)).translate((10, 20, -5)))
    rows, columns = np.nonzero(img.hit)
    assert img.rgb.shape == (480, 640, 3) and len(rows) > 5000
    assert 0 < rows.min() and rows.max() < 479 and 0 < columns.min() and columns.max() < 639
    assert sdfrs.trace_stats(sdfrs.plane()).settings.camera.origin == (3.0, 2.0, 4.0)


@pytest.mark.parametrize("call", [sdfrs.render, sdfrs.trace_stats], ids=["render", "stats"])
def test_rays_that_end_before_the_shape_begins_say_so(call):
    ball = sdfrs.sphere()
    far = sdfrs.Camera.look_at((0, 0, 150), (0, 0, 0), width=24, height=16, fov=1.0)
    flat = sdfrs.Camera.orthographic((0, 0, 150), (0, 0, 0), width=24, height=16, extent=3.0)
    for camera in (far, flat):
        with pytest.warns(UserWarning, match=r"t_max=100 ends before the shape begins, 149 ahead .* t_max=15[12]"):
            call(ball, camera)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert call(ball, camera, t_max=152).summary.hits > 0
            away = sdfrs.Camera.look_at((0, 0, 150), (0, 0, 300), width=24, height=16)
            assert call(ball, away).summary.hits == 0  # nothing is there, however far


def test_a_fitted_camera_beyond_t_max_says_so():
    with pytest.warns(UserWarning, match="t_max"):
        sdfrs.trace_stats(sdfrs.sphere(500))


@every_tracer
def test_stats_equal_the_picture(tracer):
    scene = sdfrs.load("csg")
    cam = scene.camera.resized(64, 36)
    # Pictures may skip empty cells, which takes fewer steps; measurements don't.
    st, img = sdfrs.trace_stats(scene, cam, tracer=tracer), sdfrs.render(scene, cam, tracer=tracer, prune="exact")
    for name in ("status", "steps", "fallbacks", "multiplier", "depth"):
        np.testing.assert_array_equal(getattr(st, name), getattr(img, name), err_msg=name)
    assert st.settings.tracer == tracer and img.settings.tracer == tracer
    assert st.active_rays[0] == 64 * 36 and st.summary.hits == img.hit.sum()
    assert "hits" in st._repr_html_() and tracer.name in repr(img)


def test_a_steep_field_warns_and_names_the_factor(camera):
    steep = sdfrs.sphere(1).scale(1.0).displace(lambda p: 0.3 * np.sin(10 * p.x)).with_lipschitz(1.0)
    with pytest.warns(sdfrs.LipschitzWarning, match=r"with_lipschitz\(") as caught:
        st = sdfrs.trace_stats(steep, camera)
    assert st.summary.witness > 1.01
    named = float(str(caught[0].message).split("with_lipschitz(")[1].split(")")[0])
    assert 1.01 < named <= 4.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sdfrs.trace_stats(steep, camera.resized(20, 20))  # too few rays to judge by
        for name in sdfrs.scenes.NAMES:
            scene = sdfrs.load(name)
            for tracer in ("basic", "auto_relaxed", "relaxed"):
                sdfrs.trace_stats(scene, scene.camera.resized(128, 72), tracer=tracer)


@pytest.mark.parametrize("what", ["steps", "fallbacks", "multiplier", "depth"])
def test_heat_maps_have_a_bar(what):
    img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=160, height=120))
    plain, scaled = img.heatmap(what), img.heatmap(what, vmax=50)
    assert plain.width >= 160 and plain.height > 120 + 10
    below = np.asarray(plain)[120:]
    assert len(np.unique(below.reshape(-1, 3), axis=0)) > 50  # the ramp
    assert (below == 0).all(axis=2).any()  # and letters
    assert np.asarray(scaled).shape == np.asarray(plain).shape


def test_notebooks_get_pictures_and_tables(tmp_path):
    img = sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=20, height=10))
    assert img._repr_png_().startswith(b"\x89PNG") and "data:image/png;base64," in img._repr_html_()
    assert img.to_pil().size == (20, 10) and "cpu" in img.device
    np.testing.assert_array_equal(np.asarray(img.to_pil()), img.rgb)
    assert len(repr(img)) < 100
    img.save(tmp_path / "a.png")
    from PIL import Image

    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), img.rgb)
    with pytest.raises(sdfrs.SceneError, match="png"):
        img.save(tmp_path / "a.xyz")
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_gigantic_values_are_invalid_not_hits():
    infinite = sdfrs.shape(lipschitz=1.0)(lambda p: np.exp(1000 * p.x) - np.exp(1000 * p.x))
    h = sdfrs.trace(infinite, [[5, 0, 0]], [[1, 0, 0]])
    assert h.status.tolist() == [3] and h.summary.invalid == 1


@pytest.mark.parametrize("kind", ["pinhole", "orthographic"])
def test_rays_go_through_pixel_centres(kind):
    make = sdfrs.Camera.look_at if kind == "pinhole" else sdfrs.Camera.orthographic
    size = {"fov": 60.0} if kind == "pinhole" else {"extent": 3.0}
    o, d = make((0, 0, 2), (0, 0, 0), width=6, height=4, **size).rays()
    half = math.tan(math.radians(30)) if kind == "pinhole" else 1.5
    j, i = np.meshgrid(np.arange(4), np.arange(6), indexing="ij")
    x, y = (2 * (i + 0.5) - 6) / 4 * half, (4 - 2 * (j + 0.5)) / 4 * half
    flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    want_o, want_d = (
        (flat * 0 + [0, 0, 2], flat - [0, 0, 1]) if kind == "pinhole" else (flat + [0, 0, 2], flat * 0 - [0, 0, 1])
    )
    np.testing.assert_allclose(o, want_o, atol=1e-14)
    np.testing.assert_allclose(d, want_d / np.linalg.norm(want_d, axis=1, keepdims=True), atol=1e-14)
    assert make(width=6, height=4).rays(precision="f32")[1].dtype == np.float32
