"""Textures of every kind: what they hold, how they are walked, and their files."""

import json
import pickle
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest

import sdfrs
from sdfrs import _core

BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
SCENE = sdfrs.sphere(0.6).translate((0.1, 0, 0)) - sdfrs.box((0.5, 2.0, 0.4))
KINDS = {
    "dense": {},
    "dense f16": {"dtype": "float16"},
    "dense f64": {"dtype": "float64"},
    "sparse": {"sparse": True},
    "sparse f16": {"sparse": True, "dtype": "float16"},
    "sparse u8": {"sparse": True, "dtype": "uint8"},
}
CAMERA = sdfrs.Camera.look_at((1.5, 1.2, 2.0), (0, 0, 0), width=96, height=72)


def made(kind, **more):
    return SCENE.to_texture((49, 50, 51), bounds=BOX, **KINDS[kind], **more)


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return request.param


def test_samples_are_the_shapes_values(kind, rng):
    tex = made(kind)
    dense = tex.to_dense()
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (51, 50, 49)), indexing="ij")
    want = SCENE(np.stack([x, y, z], -1).reshape(-1, 3), precision="f64").reshape(51, 50, 49)
    near = np.abs(want) < 0.1
    assert np.abs(dense.values[near] - want[near]).max() <= tex.max_error + 1e-15
    # Beyond the band a bound of the same sign.
    assert (np.abs(dense.values) <= np.abs(want) + tex.max_error).all()
    assert (np.sign(dense.values) == np.sign(want))[np.abs(want) > tex.max_error].all()
    points = rng.uniform(-0.9, 0.9, (1000, 3))
    off = np.abs(tex.sample(points).astype(float) - SCENE(points, precision="f64"))
    close = np.abs(SCENE(points, precision="f64")) < 0.1
    assert off[close].max() <= np.linalg.norm(tex.spacing) / 2 + tex.max_error + 1e-6


def test_facts(kind):
    tex = made(kind, stepping="bricks")
    assert tex.shape_zyx == (51, 50, 49) and tex.bounds == BOX
    assert tex.spacing == pytest.approx((2 / 48, 2 / 49, 2 / 50))
    assert tex.stepping == "bricks" and tex.with_stepping("safe").stepping == "safe"
    assert tex.sparse == ("sparse" in kind) and tex.dtype == np.dtype(KINDS[kind].get("dtype", "float32"))
    assert tex.brick_slopes.shape == (7, 7, 6) and 1.0 <= tex.brick_slopes.max() < 1.9
    assert tex.report is None and tex.max_error >= 0
    if not tex.sparse:
        assert tex.nbytes == tex.values.nbytes and tex.to_dense() is tex
    else:
        assert tex.nbytes < 51 * 50 * 49 * 8
        with pytest.raises(sdfrs.SceneError, match="to_dense"):
            _ = tex.values


@pytest.mark.parametrize("stepping", ["safe", "bricks", "voxel"])
def test_every_stepping_shows_the_same_surface(kind, stepping):
    tex = made(kind)
    want = sdfrs.trace_stats(tex, CAMERA, tracer="basic", eps=1e-7, max_steps=20_000, precision="f64")
    for tracer in ("auto_relaxed", "basic", "coverage_search"):
        got = sdfrs.trace_stats(
            tex.with_stepping(stepping), CAMERA, tracer=tracer, eps=1e-5, max_steps=5000, precision="f64"
        )
        assert got.summary.crossings == 0
        both = (got.status == 1) & (want.status == 1)
        assert both.sum() > 1000 and (got.status != want.status).sum() <= 4
        assert np.quantile(np.abs(got.depth[both] - want.depth[both]), 0.99) < 1e-3


def test_steps_grow_with_the_rule():
    tex = sdfrs.sphere(0.7).to_texture(65, bounds=BOX)
    steps = {
        name: sdfrs.trace_stats(tex.with_stepping(name), CAMERA, tracer="basic").summary.mean_steps
        for name in ("safe", "bricks")
    }
    assert steps["bricks"] < 0.95 * steps["safe"]


def test_voxels_take_placements_and_other_scenes_do_without():
    tex = sdfrs.sphere(0.7).to_texture(65, bounds=BOX, stepping="voxel")
    moved = tex.rotate(0.3, axis=(1, 2, 3)).scale(1.5).translate((0.1, 0.2, 0.3))
    o, d = CAMERA.rays()
    exact = sdfrs.trace(moved, o, d, precision="f64", eps=0.1)
    hit = exact.status == 1
    # The surface itself, however large eps is.
    assert np.abs(moved(o[hit] + exact.t[hit, None] * d[hit], precision="f64")).max() < 1e-9
    both = tex | sdfrs.plane(point=(0, -0.5, 0))
    assert sdfrs.trace_stats(both, CAMERA).summary.hits > hit.sum() / 2


def test_a_texture_raises_no_warning_of_steepness(recwarn):
    for name in KINDS:
        sdfrs.trace_stats(made(name, stepping="bricks"), CAMERA)
    assert not [w for w in recwarn if issubclass(w.category, sdfrs.LipschitzWarning)]


def test_normals_are_continuous():
    tex = sdfrs.sphere(0.7).to_texture(33, bounds=BOX)
    flat = sdfrs.Camera.look_at((0, 0, 3), (0, 0, 0), fov=0.5, width=256, height=8)
    image = sdfrs.render(tex, flat, eps=1e-6, max_steps=5000)
    normals = image.normals[4][image.hit[4]].astype(float)
    # 16 pixels a voxel: no step of the normal is much longer than the mean one.
    jumps = np.linalg.norm(np.diff(normals, axis=0), axis=1)
    assert len(jumps) > 200 and jumps.max() < 6 * jumps.mean()


def test_npz_reads_back_bit_for_bit(kind, tmp_path):
    tex = made(kind, stepping="bricks")
    path = tmp_path / "t.npz"
    tex.save(path)
    back = sdfrs.load(path)
    assert isinstance(back, sdfrs.SdfTexture) and back._facts == tex._facts
    a, b = (sdfrs.trace_stats(t, CAMERA) for t in (tex, back))
    assert (a.depth == b.depth).all() and (a.steps == b.steps).all()
    np.testing.assert_array_equal(back.brick_slopes, tex.brick_slopes)
    back.save(tmp_path / "u.npz")
    assert (tmp_path / "u.npz").read_bytes() == path.read_bytes()
    with np.load(path, allow_pickle=False) as arrays:  # numpy reads them too
        assert ("nodes" in arrays) == tex.sparse
        if not tex.sparse:
            np.testing.assert_array_equal(arrays["values"], tex.values)


def test_scene_files_and_pickles_hold_every_kind(kind, tmp_path):
    tex = made(kind, stepping="bricks")
    scene = sdfrs.Scene(tex | sdfrs.sphere(0.1), CAMERA)
    scene.save(tmp_path / "s.json")
    for back in (sdfrs.load(tmp_path / "s.json").shape, pickle.loads(pickle.dumps(scene.shape))):
        a, b = (sdfrs.trace_stats(t, CAMERA) for t in (scene.shape, back))
        assert (a.depth == b.depth).all() and (a.steps == b.steps).all()
    assert pickle.loads(pickle.dumps(tex))._facts == tex._facts


def test_raw_and_vol(kind, tmp_path):
    tex = made(kind)
    dense = tex.to_dense()
    tex.save(tmp_path / "t.raw")
    header = json.loads((tmp_path / "t.json").read_text())
    raw = np.fromfile(tmp_path / header["data"], header["dtype"]).reshape(header["shape"])
    np.testing.assert_array_equal(raw, dense.values)
    assert header["lo"] == [-1, -1, -1]
    tex.save(tmp_path / "t.vol")
    data = (tmp_path / "t.vol").read_bytes()
    assert data[:4] == b"VOL\x03"
    assert struct.unpack("<iiiii6f", data[4:48]) == (1, 49, 50, 51, 1, -1, -1, -1, 1, 1, 1)
    np.testing.assert_array_equal(np.frombuffer(data[48:], "<f4").reshape(51, 50, 49), dense.values.astype("<f4"))
    with pytest.raises(sdfrs.SceneError, match=r"\.npz, \.raw, \.vol"):
        tex.save(tmp_path / "t.tiff")


def parts(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def npy(array):
    import io

    out = io.BytesIO()
    np.lib.format.write_array(out, np.asarray(array), allow_pickle=True)
    return out.getvalue()


def forged(shape, dtype="<f4"):
    """A header that claims more than there is."""
    import io

    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": dtype, "fortran_order": False, "shape": shape})
    return out.getvalue() + b"\0" * 64


SPOILT = {
    "no version": (lambda p: p.pop("sdfrs_texture.npy"), "sdfrs_texture: missing"),
    "another version": (lambda p: p.update({"sdfrs_texture.npy": npy(np.array(2, "<i8"))}), "version 2"),
    "unknown member": (lambda p: p.update({"evil.npy": npy(1.0)}), "unknown member 'evil.npy'"),
    "path": (lambda p: p.update({"../../values.npy": npy(1.0)}), "unknown member"),
    "pickle": (lambda p: p.update({"far.npy": npy(np.array([{}], object))}), "far: got dtype '|O'"),
    "wrong dtype": (lambda p: p.update({"table.npy": npy(np.zeros((2, 2, 2), "<i8"))}), "table: got dtype '<i8'"),
    "bomb": (lambda p: p.update({"nodes.npy": forged((1024, 1024, 1024))}), "needs 4294967296 bytes"),
    "overflow": (lambda p: p.update({"nodes.npy": forged((2**62, 2**62, 9, 9))}), "nodes: shape"),
    "negative": (lambda p: p.update({"nodes.npy": forged((-1, 9, 9, 9))}), "nodes"),
    "header": (lambda p: p.update({"far.npy": b"\x93NUMPY\x01\x00\x10\x00__import__('os')"}), "far: not a .npy header"),
    "not npy": (lambda p: p.update({"far.npy": b"hello"}), "far: not a .npy header"),
    "bounds": (lambda p: p.update({"bounds.npy": npy(np.ones((2, 3)))}), "lo below hi"),
    "nan bounds": (lambda p: p.update({"bounds.npy": npy(np.full((2, 3), np.nan))}), "bounds"),
    "flat bounds": (lambda p: p.update({"bounds.npy": npy(np.ones(6))}), "bounds: got shape (6,)"),
    "stepping": (lambda p: p.update({"stepping.npy": npy(np.frombuffer(b"fast", np.uint8))}), "stepping: got 'fast'"),
    "table": (lambda p: p.update({"table.npy": npy(np.full((7, 7, 6), 99999, "<u4"))}), "allowed: below"),
    "short table": (lambda p: p.update({"table.npy": npy(np.zeros((1, 1, 1), "<u4"))}), "table"),
    "nan nodes": (lambda p: p.update({"nodes.npy": npy(np.full((400, 9, 9, 9), np.nan, "<f4"))}), "finite"),
    "dims": (lambda p: p.update({"dims.npy": npy(np.array([1, 2, 2**40]))}), "dims"),
    "report": (lambda p: p.update({"report.npy": npy(np.frombuffer(b"{}", np.uint8))}), "report"),
    "claim": (lambda p: p.update({"lipschitz.npy": npy(np.array(-1.0))}), "allowed"),
    "neither": (lambda p: p.pop("nodes.npy"), "nodes: missing"),
}


@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_files_are_refused(name, tmp_path):
    made("sparse").save(tmp_path / "t.npz")
    members = parts(tmp_path / "t.npz")
    spoil, words = SPOILT[name]
    spoil(members)
    with zipfile.ZipFile(tmp_path / "bad.npz", "w") as archive:
        for key, data in members.items():
            archive.writestr(key, data)
    with pytest.raises(sdfrs.FormatError) as caught:
        sdfrs.load(tmp_path / "bad.npz")
    assert "bad.npz" in str(caught.value) and words in str(caught.value)


def test_truncated_and_flipped_files_are_refused(tmp_path, rng):
    tex = sdfrs.sphere(0.5).to_texture(17, bounds=BOX, sparse=True)
    tex.save(tmp_path / "t.npz")
    data = (tmp_path / "t.npz").read_bytes()
    for n in rng.integers(4, len(data) - 1, 40):
        (tmp_path / "bad.npz").write_bytes(data[:n])
        with pytest.raises(sdfrs.FormatError):
            sdfrs.load(tmp_path / "bad.npz")
    for at in rng.integers(4, len(data), 200):
        spoilt = bytearray(data)
        spoilt[at] ^= 1 << rng.integers(8)
        (tmp_path / "bad.npz").write_bytes(spoilt)
        try:
            sdfrs.load(tmp_path / "bad.npz")
        except sdfrs.FormatError:
            pass


def test_a_zip_bomb_is_refused_by_its_directory(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("values.npy", forged((64,)))
        info = archive.getinfo("values.npy")
        info.file_size = 2**50
    with pytest.raises(sdfrs.FormatError, match="a quarter of the memory"):
        sdfrs.load(tmp_path / "bomb.npz")


@pytest.mark.parametrize("ending", ["npz", "raw", "vol"])
@pytest.mark.parametrize("fault", [KeyboardInterrupt, OSError])
def test_a_failed_save_leaves_the_old_files(tmp_path, monkeypatch, ending, fault):
    path = tmp_path / f"t.{ending}"
    made("dense").save(path)
    before = {p: p.read_bytes() for p in tmp_path.iterdir()}
    samples, calls = _core.texture_samples, []

    def second_slab(*span):
        calls.append(span)
        if len(calls) == 2:
            raise fault
        return samples(*span)

    monkeypatch.setattr("sdfrs.texture_file._SLAB", 1 << 16)
    monkeypatch.setattr(_core, "texture_samples", second_slab)
    with pytest.raises(fault):
        made("dense f16").save(path)
    assert {p: p.read_bytes() for p in tmp_path.iterdir()} == before


def most_memory(call):
    """The most bytes that Python's allocations held during a call."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("ending", ["npz", "raw", "vol"])
def test_files_are_written_in_slabs(tmp_path, ending):
    tex = sdfrs.sphere(0.9).to_texture(192, bounds=BOX)
    if ending == "npz":
        tex = sdfrs.sphere(0.9).to_texture(256, bounds=BOX, sparse=True, band=0.4)
    most = most_memory(lambda: tex.save(tmp_path / f"t.{ending}"))
    assert tex.nbytes > 25e6 and most < 10e6, (tex.nbytes, most)


@pytest.mark.parametrize("ending", ["raw", "vol"])
def test_a_sparse_texture_is_never_whole_in_memory(tmp_path, monkeypatch, ending):
    tex = sdfrs.sphere(0.9).to_texture((130, 100, 90), bounds=BOX, sparse=True)
    want = tex.to_dense().values.tobytes()
    refuse = lambda *args: pytest.fail("made dense in memory")  # noqa: E731
    monkeypatch.setattr(_core, "texture_changed", refuse)
    monkeypatch.setattr("sdfrs.texture_file._SLAB", 1 << 17)
    most = most_memory(lambda: tex.save(tmp_path / f"t.{ending}"))
    assert (tmp_path / f"t.{ending}").read_bytes()[48 if ending == "vol" else 0 :] == want
    assert most < len(want) / 4, (most, len(want))


def test_a_missing_folder_or_file_is_an_error_of_ours(tmp_path):
    for call in (
        lambda: made("dense").save(tmp_path / "no" / "t.npz"),
        lambda: sdfrs.Scene(SCENE).save(tmp_path / "no" / "s.json"),
        lambda: sdfrs.load(tmp_path / "no.npz"),
        lambda: sdfrs.load(tmp_path / "no.json"),
        lambda: sdfrs.mesh_to_sdf_texture(tmp_path / "no.obj"),
    ):
        with pytest.raises(sdfrs.Error, match="no ") as caught:
            call()
        assert isinstance(caught.value, sdfrs.MissingFileError) and isinstance(caught.value, FileNotFoundError)


BAD = {
    "resolution 1": lambda: SCENE.to_texture(1),
    "absurd resolution": lambda: SCENE.to_texture(60_000),
    "resolution of two": lambda: SCENE.to_texture((8, 8)),
    "unbounded": lambda: sdfrs.plane().to_texture(8),
    "bounds inside out": lambda: SCENE.to_texture(8, bounds=(BOX[1], BOX[0])),
    "negative padding": lambda: SCENE.to_texture(8, padding=-0.1),
    "dtype": lambda: SCENE.to_texture(8, dtype="int8"),
    "dense bytes": lambda: SCENE.to_texture(8, dtype="uint8"),
    "sparse f64": lambda: SCENE.to_texture(8, dtype="float64", sparse=True),
    "band of a dense one": lambda: SCENE.to_texture(8, band=0.5),
    "band of nothing": lambda: SCENE.to_texture(8, sparse=True, band=0.0),
    "thin band": lambda: SCENE.to_texture(8, sparse=True, band=1e-3),
    "stepping": lambda: SCENE.to_texture(8, stepping="fast"),
    "no bound": lambda: sdfrs.ellipsoid((1, 2, 3)).twist(1).to_texture(8, bounds=BOX, sparse=True),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_requests(name):
    with pytest.raises(sdfrs.SceneError):
        BAD[name]()


def test_progress_is_told():
    seen = []
    sdfrs.load("spheres1000").shape.to_texture(96, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (96**3, 96**3) and all(a[0] <= b[0] for a, b in zip(seen, seen[1:]))
