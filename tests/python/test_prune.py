"""Pruning over the shipped scenes: exact keeps every number, skip every status, and the summary says what was done."""

import numpy as np
import pytest

import sdfrs

SCENES = (
    "csg", "village", "composition", "mandelbulb", "gyroid", "spheres1000", "grazing_plane", "thin_shell", "near_miss",
)  # fmt: skip
STEPPERS = (sdfrs.Basic(), sdfrs.Relaxed(), sdfrs.Enhanced(), sdfrs.AutoRelaxed())
SIZE = (160, 90)


def run(name, prune, tracer="enhanced", **settings):
    scene = sdfrs.load(name)
    return sdfrs.trace_stats(scene, scene.camera.resized(*SIZE), tracer=tracer, prune=prune, **settings)


@pytest.mark.parametrize("name", SCENES)
def test_exact_keeps_every_number(name):
    for i, tracer in enumerate(STEPPERS):
        precision = ("f32", "f64")[i % 2]
        off, exact = (run(name, prune, tracer, precision=precision) for prune in ("off", "exact"))
        for field in ("status", "steps", "fallbacks", "multiplier", "depth", "flags"):
            np.testing.assert_array_equal(getattr(off, field), getattr(exact, field), err_msg=f"{tracer} {field}")
        assert off.summary.prune == "off" and off.summary.witness == exact.summary.witness


@pytest.mark.parametrize("name", SCENES)
def test_skip_keeps_every_status_but_of_rays_that_graze(name):
    eps = 1e-4
    for tracer in STEPPERS:
        off, skip = run(name, "off", tracer), run(name, "skip", tracer)
        other = off.status != skip.status
        # A glance within the threshold may end either way.
        assert other.sum() <= 0.002 * other.size, f"{tracer}: {other.sum()} rays end otherwise"
        both = (off.status == 1) & (skip.status == 1)
        far = np.abs(off.depth[both] - skip.depth[both]) > 10 * eps
        assert far.sum() <= 0.005 * both.sum(), f"{tracer}: {far.sum()} of {both.sum()} depths differ"
        assert skip.summary.evaluations <= 1.02 * off.summary.evaluations


def test_the_summary_says_what_was_done():
    off, exact, skip = (run("spheres1000", prune).summary for prune in ("off", "exact", "skip"))
    assert (off.prune, exact.prune, skip.prune) == ("off", "exact", "skip")
    assert off.mean_ops == off.p50_ops == off.p99_ops >= 1000 and off.arena_bytes == 0
    # Far behind the scene a pixel of a picture this small holds all of it.
    assert exact.p50_ops < exact.p99_ops <= 1000 and exact.mean_ops < 700 and exact.arena_bytes > 0
    assert skip.node_evaluations < min(exact.node_evaluations, off.node_evaluations)
    assert skip.evaluations < exact.evaluations == off.evaluations


def test_auto_is_exact_where_rays_are_measured_and_may_skip_in_pictures():
    scene = sdfrs.load("spheres1000")
    camera = scene.camera.resized(320, 180)
    assert sdfrs.trace_stats(scene, camera).summary.prune == "exact"
    assert sdfrs.render(scene, camera).summary.prune == "skip"
    rays = camera.rays()
    found = sdfrs.trace(scene, *rays)
    assert found.summary.prune == "exact"
    np.testing.assert_array_equal(found.steps, sdfrs.trace(scene, *rays, prune="off").steps)
    # One primitive isn't worth it, nor are a few rays.
    assert sdfrs.render(sdfrs.sphere(), camera).summary.prune == "off"
    assert sdfrs.render(scene, camera.resized(16, 16)).summary.prune == "off"
    assert sdfrs.trace_stats(scene, camera, tracer="binary_search", t_max=20.0).summary.prune == "off"


def test_what_is_not_a_kind_of_pruning():
    for call in (sdfrs.render, sdfrs.trace_stats):
        with pytest.raises((sdfrs.SceneError, TypeError, ValueError), match="prune"):
            call(sdfrs.sphere(), sdfrs.Camera.look_at(width=4, height=4), prune="all")


def test_the_number_of_threads_changes_nothing():
    results = []
    for threads in (1, 3):
        sdfrs.set_threads(threads)
        results.append(run("csg", "skip"))
    sdfrs.set_threads(0)
    for field in ("status", "steps", "depth"):
        np.testing.assert_array_equal(getattr(results[0], field), getattr(results[1], field))
    assert results[0].summary.node_evaluations == results[1].summary.node_evaluations
