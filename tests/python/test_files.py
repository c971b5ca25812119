"""Scene files: what is written reads back bit for bit, and what is wrong is refused with its place."""

import json
import os

import numpy as np
import pytest

import sdfrs
from conftest import every_shape

NAMES = list(every_shape())
SCENES = [
    "csg", "village", "composition", "mandelbulb", "gyroid", "spheres1000", "grazing_plane", "thin_shell", "near_miss",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_every_shape_reads_back_bit_for_bit(name, shapes, tmp_path, rng):
    path, again = tmp_path / "a.json", tmp_path / "b.json"
    sdfrs.Scene(shapes[name]).save(path)
    loaded = sdfrs.load(path)
    points = rng.uniform(-3, 3, (500, 3))
    np.testing.assert_array_equal(loaded.shape(points, "f64"), shapes[name](points, "f64"))
    assert loaded.shape.lipschitz == shapes[name].lipschitz and loaded.shape.bounds == shapes[name].bounds
    loaded.save(again)
    assert path.read_bytes() == again.read_bytes()
    assert json.loads(path.read_text())["sdfrs"] == 1


@pytest.mark.parametrize("kind", ["pinhole", "orthographic"])
def test_cameras_lights_and_colours_read_back(kind, tmp_path):
    make = sdfrs.Camera.look_at if kind == "pinhole" else sdfrs.Camera.orthographic
    scene = sdfrs.Scene(
        sdfrs.sphere(),
        camera=make((0.1, 2, 3), (1 / 3, 0, 0), up=(0, 1, 0.1), width=123, height=45),
        lights=[sdfrs.PointLight((1, 2, 3), (0.5, 0.25, 1 / 3), 0.7), sdfrs.PointLight((3, 2, 1))],
        background=(0.1, 0.2, 0.3),
        albedo=(1, 0.5, 0),
    )
    scene.save(tmp_path / "a.json")
    loaded = sdfrs.load(str(tmp_path / "a.json"))
    for name in ("camera", "lights", "background", "albedo"):
        assert getattr(loaded, name) == getattr(scene, name), name
    bare = sdfrs.Scene(sdfrs.sphere())
    bare.save(tmp_path / "b.json")
    assert sdfrs.load(tmp_path / "b.json").camera is None and sdfrs.load(tmp_path / "b.json").lights is None


@pytest.mark.parametrize("name", SCENES)
def test_named_scenes_load_save_and_render(name, tmp_path):
    scene = sdfrs.load(name)
    assert scene.camera is not None and scene.lights and np.isfinite(scene.shape.lipschitz)
    img = sdfrs.render(scene, scene.camera.resized(64, 36))
    assert img.hit.mean() > 0.1 and not (img.status == 3).any()
    assert len(np.unique(img.rgb.reshape(-1, 3), axis=0)) > 10
    scene.save(tmp_path / "a.json")
    twin = sdfrs.render(sdfrs.load(tmp_path / "a.json"), scene.camera.resized(64, 36))
    np.testing.assert_array_equal(twin.rgb, img.rgb)
    assert set(sdfrs.scenes.NAMES) == set(SCENES)


def test_the_village_has_several_hundred_houses():
    village = sdfrs.load("village").shape
    side = np.arange(-42, 42, 0.1)
    x, z = np.meshgrid(side, side)
    solid = village(np.stack([x.ravel(), np.full(x.size, 0.3), z.ravel()], axis=1)).reshape(x.shape) < 0
    left = set(zip(*np.nonzero(solid)))
    houses = 0
    while left:  # flood one house after the other
        houses, front = houses + 1, [left.pop()]
        while front:
            i, j = front.pop()
            for near in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if near in left:
                    left.remove(near)
                    front.append(near)
    assert 300 <= houses <= 1000


def test_a_file_in_the_way_wins_over_no_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sdfrs.Scene(sdfrs.sphere(7)).save("csg")
    assert sdfrs.load("csg").shape.bounds[1] == (7.0, 7.0, 7.0)


def test_saving_is_all_or_nothing(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    sdfrs.Scene(sdfrs.sphere(1)).save(path)
    before = path.read_bytes()

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="disk full"):
        sdfrs.Scene(sdfrs.sphere(2)).save(path)
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["a.json"]
    with pytest.raises(OSError):
        sdfrs.Scene(sdfrs.sphere(2)).save(tmp_path / "no" / "folder.json")


def text(**changes):
    scene = {"sdfrs": 1, "nodes": [{"op": "sphere", "radius": 1.0}], "root": 0}
    return json.dumps({**scene, **changes})


CAMERA = {
    "kind": "pinhole", "origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 40, "width": 8, "height": 8,
}  # fmt: skip
REFUSED = {
    "empty": ("", None),
    "not json": ("{", None),
    "list": ("[]", None),
    "version": (text(sdfrs=2), "sdfrs"),
    "no version": (text().replace('"sdfrs": 1, ', ""), "sdfrs"),
    "no root": (text().replace(', "root": 0', ""), "root"),
    "root beyond": (text(root=1), "root"),
    "root negative": (text(root=-1), "root"),
    "no nodes": (text(nodes=[]), None),
    "unknown key": (text(extra=1), "extra"),
    "unknown node key": (text(nodes=[{"op": "sphere", "radius": 1, "size": 2}]), "nodes[0]"),
    "unknown op": (text(nodes=[{"op": "sfere", "radius": 1}]), "nodes[0]"),
    "missing argument": (text(nodes=[{"op": "sphere"}]), "nodes[0]"),
    "negative radius": (text(nodes=[{"op": "sphere", "radius": -1}]), "nodes[0]"),
    "text for a number": (text(nodes=[{"op": "sphere", "radius": "1"}]), "nodes[0].radius"),
    "nan": ('{"sdfrs": 1, "nodes": [{"op": "sphere", "radius": NaN}], "root": 0}', None),
    "infinity": ('{"sdfrs": 1, "nodes": [{"op": "sphere", "radius": 1e999}], "root": 0}', None),
    "duplicate key": ('{"sdfrs": 1, "nodes": [{"op": "sphere", "radius": 1, "radius": 2}], "root": 0}', "radius"),
    "forward reference": (text(nodes=[{"op": "negate", "of": [1]}, {"op": "sphere", "radius": 1}]), "nodes[0]"),
    "self reference": (text(nodes=[{"op": "negate", "of": [0]}]), "nodes[0]"),
    "expression as root": (text(nodes=[{"op": "x"}]), "root"),
    "camera kind": (text(camera={**CAMERA, "kind": "fisheye"}), "camera.kind"),
    "camera fov": (text(camera={**CAMERA, "fov": 200}), "camera.fov"),
    "camera key": (text(camera={**CAMERA, "roll": 1}), "camera"),
    "camera size": (text(camera={**CAMERA, "width": 0}), "camera"),
    "huge image": (text(camera={**CAMERA, "width": 10**12}), "camera.width"),
    "light": (text(lights=[{"position": [0, 0]}]), "lights[0].position"),
    "light intensity": (text(lights=[{"position": [0, 0, 0], "intensity": -1}]), "lights[0].intensity"),
    "background": (text(background=[2, 0, 0]), "background"),
    "deep json": ("[" * 200_000, None),
    "deep object": ('{"a":' * 200_000, None),
    "broken texture": (text(nodes=[{"op": "texture", "dims": [2, 2, 2], "dtype": "f32", "lo": [0, 0, 0], "hi": [1, 1, 1], "data": "AAAA"}]), "nodes[0]"),
    "absurd texture": (text(nodes=[{"op": "texture", "dims": [2**31, 2**31, 2**31], "dtype": "f32", "lo": [0, 0, 0], "hi": [1, 1, 1], "data": ""}]), "nodes[0]"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_files_are_refused_with_their_place(name, tmp_path):
    content, place = REFUSED[name]
    path = tmp_path / "scene.json"
    path.write_text(content)
    with pytest.raises(sdfrs.FormatError) as caught:
        sdfrs.load(path)
    assert "scene.json" in str(caught.value)
    assert place is None or place in str(caught.value), str(caught.value)
    assert len(str(caught.value)) < 1000


def test_right_files_are_not_refused(tmp_path):
    (tmp_path / "a.json").write_text(text(camera=CAMERA, lights=[{"position": [1, 2, 3]}], background=[0, 0, 0]))
    assert sdfrs.load(tmp_path / "a.json").camera.width == 8


def test_not_text_and_not_there(tmp_path):
    (tmp_path / "a.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(sdfrs.FormatError, match="UTF-8"):
        sdfrs.load(tmp_path / "a.json")
    with pytest.raises(FileNotFoundError, match="village"):
        sdfrs.load("vilage")
    with pytest.raises(TypeError):
        sdfrs.load(3)


def test_100000_deep_saves_loads_and_evaluates(tmp_path):
    shape = sdfrs.sphere(1)
    for _ in range(100_000):
        shape = shape.translate((1e-5, 0, 0))
    sdfrs.Scene(shape).save(tmp_path / "deep.json")
    loaded = sdfrs.load(tmp_path / "deep.json")
    assert loaded.shape([[3, 0, 0]], precision="f64")[0] == pytest.approx(1.0)
    img = sdfrs.render(loaded.shape, sdfrs.Camera.look_at((1, 0, 6), (1, 0, 0), width=16, height=12))
    assert img.hit.any()


def test_shared_parts_are_written_once(tmp_path):
    ball = sdfrs.sphere(1)
    both = ball
    for _ in range(40):  # 2^40 paths, 41 nodes
        both = both | both.translate((1, 0, 0))
    sdfrs.Scene(both).save(tmp_path / "a.json")
    assert (tmp_path / "a.json").stat().st_size < 10_000
    assert len(json.loads((tmp_path / "a.json").read_text())["nodes"]) <= 81
