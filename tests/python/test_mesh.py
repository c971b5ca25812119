"""Meshes to textures: inputs of every kind, signs, reports, and what is refused."""

import json
import subprocess
import sys

import numpy as np
import pytest

import sdfrs


def sphere(n=24, radius=1.0, centre=(0, 0, 0)):
    """A closed, oriented ball of latitudes and longitudes: triangles at the poles, quadrilaterals between."""
    theta = np.linspace(0, np.pi, n + 1)[1:-1]
    phi = np.linspace(0, 2 * np.pi, 2 * n, endpoint=False)
    ring = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.cos(theta), np.ones(2 * n)),
            np.outer(np.sin(theta), np.sin(phi)),
        ],
        -1,
    ).reshape(-1, 3)
    vertices = np.concatenate([[[0, 1, 0]], ring, [[0, -1, 0]]]) * radius + centre
    at = lambda i, j: 1 + i * 2 * n + j % (2 * n)
    faces = [[0, at(0, j + 1), at(0, j)] for j in range(2 * n)]
    faces += [[at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)] for i in range(n - 2) for j in range(2 * n)]
    faces += [[len(vertices) - 1, at(n - 2, j), at(n - 2, j + 1)] for j in range(2 * n)]
    return vertices, faces


def triangles(faces):
    return np.array([[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1)])


V, POLYGONS = sphere()
F = triangles(POLYGONS)
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def same(a, b):
    return np.array_equal(a.to_dense().values, b.to_dense().values) and a.bounds == b.bounds


def test_a_ball_is_a_ball(rng):
    tex = sdfrs.mesh_to_sdf_texture(V, F, resolution=48)
    z, y, x = np.meshgrid(*[np.linspace(l, h, 48) for l, h in zip(*tex.bounds)], indexing="ij")
    want = np.sqrt(x * x + y * y + z * z) - 1
    # The facets cut the ball by up to 1 - cos(pi / 24).
    assert (
        np.abs(tex.values - want).max() < 0.013 and (np.sign(tex.values) == np.sign(want))[np.abs(want) > 0.013].all()
    )
    assert tex.report.watertight and tex.report.manifold and tex.report.sign == "pseudonormal"
    assert tex.report.signed_volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert 0 <= tex.max_error < 1e-5 and tex.lipschitz < 2 and tex.report.seconds > 0


def test_inputs_of_every_kind_agree(tmp_path):
    want = sdfrs.mesh_to_sdf_texture(V, F, resolution=24)

    class Like:
        vertices, faces = V, F

    for mesh in [
        (V.tolist(), F.tolist()),
        (V, F.astype(np.uint8) if F.max() < 256 else F.astype(np.uint64)),
        (np.asfortranarray(V), F[:, ::1]),
        (Like(),),
    ]:
        assert same(sdfrs.mesh_to_sdf_texture(*mesh, resolution=24), want)
    # Cut along the other diagonal the triangles differ, by roundings.
    polygons = sdfrs.mesh_to_sdf_texture(V, POLYGONS, resolution=24)
    assert polygons.report.faces == len(F) and np.abs(polygons.values - want.values).max() < 1e-6
    narrow = V.astype(np.float32)
    assert same(
        sdfrs.mesh_to_sdf_texture(narrow, F, resolution=24),
        sdfrs.mesh_to_sdf_texture(narrow.astype(float), F, resolution=24),
    )


def test_a_trimesh_is_taken():
    import trimesh

    box = trimesh.creation.box()
    tex = sdfrs.mesh_to_sdf_texture(box, resolution=16)
    assert tex.report.watertight and tex.report.faces == 12


def test_files_of_every_format(tmp_path):
    want = sdfrs.mesh_to_sdf_texture(CUBE, triangles(SIDES), resolution=16)
    lines = {
        "obj": "\n".join([f"v {x} {y} {z}" for x, y, z in CUBE] + ["f " + " ".join(str(i + 1) for i in f) for f in SIDES]),
        "off": "\n".join(["OFF", "8 6 0"] + [f"{x} {y} {z}" for x, y, z in CUBE] + ["4 " + " ".join(map(str, f)) for f in SIDES]),
        "ply": "\n".join(
            ["ply", "format ascii 1.0", "element vertex 8", "property float x", "property float y", "property float z",
             "element face 6", "property list uchar int vertex_indices", "end_header"]
            + [f"{x} {y} {z}" for x, y, z in CUBE] + ["4 " + " ".join(map(str, f)) for f in SIDES]
        ),
        "stl": "solid a\n" + "".join(
            "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in CUBE[f]) + "endloop\nendfacet\n"
            for f in triangles(SIDES)
        ) + "endsolid a\n",
    }  # fmt: skip
    for ending, text in lines.items():
        path = tmp_path / f"cube.{ending}"
        path.write_text(text + "\n")
        tex = sdfrs.mesh_to_sdf_texture(path, resolution=16)
        assert tex.report.watertight and np.abs(tex.values - want.values).max() < 1e-6, ending


@pytest.mark.parametrize("dtype", ["float32", "float16", "uint8"])
def test_sparse_textures_hold_the_dense_ones_samples(dtype):
    dense = sdfrs.mesh_to_sdf_texture(V, F, resolution=65)
    sparse = sdfrs.mesh_to_sdf_texture(V, F, resolution=65, sparse=True, dtype=dtype)
    near = np.abs(dense.values) < 3 * dense.spacing[0]
    got = sparse.to_dense().values
    assert np.abs(got[near] - dense.values[near]).max() <= sparse.max_error + dense.max_error
    assert (np.abs(got) <= np.abs(dense.values) + sparse.max_error).all()
    assert sparse.nbytes < dense.nbytes * {"float32": 1.2, "float16": 0.6, "uint8": 0.3}[dtype]
    camera = sdfrs.Camera.look_at((2, 1.5, 3), width=64, height=48)
    a, b = (sdfrs.trace_stats(t, camera) for t in (dense, sparse))
    assert (a.status != b.status).sum() <= 3


def test_bounds_padding_and_resolution():
    tex = sdfrs.mesh_to_sdf_texture(CUBE, SIDES, resolution=(9, 17, 33), bounds=((-1, -1, -1), (2, 2, 2)))
    assert tex.shape_zyx == (33, 17, 9) and tex.bounds == ((-1, -1, -1), (2, 2, 2))
    tex = sdfrs.mesh_to_sdf_texture(CUBE * (1, 2, 3), SIDES, resolution=16, padding=0.5)
    np.testing.assert_allclose(tex.bounds, ((-2.5, -2, -1.5), (3.5, 4, 4.5)))
    tex = sdfrs.mesh_to_sdf_texture(CUBE * (1, 2, 3), SIDES, resolution=(5, 6, 7), padding=0.0)
    np.testing.assert_allclose(tex.bounds, ((0, 0, 0), (1, 2, 3)))


def test_damage_is_reported():
    holed = np.delete(F, slice(0, 12), axis=0)
    dirty = np.concatenate([holed, holed[:3], [[5, 5, 6]]])
    tex = sdfrs.mesh_to_sdf_texture(V, dirty, resolution=24)
    r = tex.report
    assert not r.watertight and r.boundary_edges > 0 and r.sign == "winding"
    assert (r.duplicate_faces, r.degenerate_faces) == (3, 1)
    assert "open" in str(r) and "winding" in str(r) and r.why
    assert float(tex([[0, 0, 0]])[0]) < -0.9 and float(tex([[0, -1.2, 0]])[0]) > 0
    sure = sdfrs.mesh_to_sdf_texture(V, dirty, resolution=24, confidence=True).report.confidence
    assert sure.shape == (24, 24, 24) and 0 <= sure.min() and sure.max() <= 1


@pytest.mark.parametrize("sign", ["winding", "pseudonormal", "parity", "unsigned"])
def test_signs_by_name(sign):
    tex = sdfrs.mesh_to_sdf_texture(CUBE, SIDES, resolution=16, sign=sign)
    assert tex.report.sign == sign
    assert (float(tex.sample([[0.5, 0.5, 0.5]])[0]) < 0) == (sign != "unsigned")


def test_a_report_survives_the_file(tmp_path):
    tex = sdfrs.mesh_to_sdf_texture(CUBE, SIDES, resolution=16, confidence=True, sparse=False)
    tex.save(tmp_path / "t.npz")
    back = sdfrs.load(tmp_path / "t.npz").report
    assert str(back) == str(tex.report) and back.bounds == tex.report.bounds
    np.testing.assert_array_equal(back.confidence, tex.report.confidence)


def test_threads_change_no_bit():
    sdfrs.set_threads(1)
    try:
        one = sdfrs.mesh_to_sdf_texture(V, F, resolution=40)
    finally:
        sdfrs.set_threads(0)
    assert same(one, sdfrs.mesh_to_sdf_texture(V, F, resolution=40))


NAN, FAR = V.copy(), V.copy()
NAN[17, 1], FAR[3, 2] = np.nan, np.inf
MESHES = {
    "nan vertex": (lambda: (NAN, F), ["vertex 17"]),
    "infinite vertex": (lambda: (FAR, F), ["vertex 3"]),
    "index out of range": (lambda: (CUBE, [[0, 1, 2], [0, 1, 8]]), ["face 1", "8", "0 to 7"]),
    "negative index": (lambda: (CUBE, [[0, 1, -1]]), ["face 0", "-1"]),
    "huge index": (lambda: (CUBE, np.array([[0, 1, 2**63]], np.uint64)), ["face 0"]),
    "no vertices": (lambda: (np.zeros((0, 3)), np.zeros((0, 3), int)), ["empty"]),
    "no faces": (lambda: (CUBE, np.zeros((0, 3), int)), ["empty"]),
    "one triangle": (lambda: (CUBE, [[0, 1, 2]]), ["unsigned"]),
    "all degenerate": (lambda: (CUBE, [[0, 0, 1], [2, 2, 2], [3, 4, 3]]), ["area"]),
    "two corners": (lambda: (CUBE, [[0, 1], [0, 1, 2]]), ["face 0"]),
    "flat vertices": (lambda: (np.zeros((4, 2)), [[0, 1, 2]]), ["(N, 3)"]),
    "flat faces": (lambda: (CUBE, [0, 1, 2]), ["(F, 3)"]),
}


@pytest.mark.parametrize("name", MESHES)
def test_bad_meshes(name):
    make, words = MESHES[name]
    with pytest.raises(sdfrs.MeshError) as caught:
        sdfrs.mesh_to_sdf_texture(*make(), resolution=8)
    for word in words:
        assert word in str(caught.value), str(caught.value)


REQUESTS = {
    "resolution 0": ({"resolution": 0}, "resolution"),
    "resolution 1": ({"resolution": 1}, "resolution"),
    "absurd resolution": ({"resolution": 60_000}, "bytes"),
    "resolution of two": ({"resolution": (8, 8)}, "resolution"),
    "bounds inside out": ({"bounds": ((1, 1, 1), (0, 0, 0))}, "bounds"),
    "flat bounds": ({"bounds": ((0, 0, 0), (1, 0, 1))}, "bounds"),
    "nan bounds": ({"bounds": ((0, 0, np.nan), (1, 1, 1))}, "bounds"),
    "negative padding": ({"padding": -0.1}, "padding"),
    "sign": ({"sign": "guess"}, "sign"),
    "dtype": ({"dtype": "float64"}, "dtype"),
    "dense bytes": ({"dtype": "uint8"}, "sparse"),
    "negative band": ({"band": -1.0}, "band"),
    "thin band": ({"band": 1e-9, "sparse": True}, "band"),
    "stepping": ({"stepping": "fast"}, "stepping"),
}


@pytest.mark.parametrize("name", REQUESTS)
def test_bad_requests(name):
    settings, word = REQUESTS[name]
    with pytest.raises(sdfrs.MeshError, match=word):
        sdfrs.mesh_to_sdf_texture(CUBE, SIDES, **{"resolution": 8, **settings})


WRONG = {
    "nothing": lambda: sdfrs.mesh_to_sdf_texture(3),
    "vertices alone": lambda: sdfrs.mesh_to_sdf_texture(V),
    "words": lambda: sdfrs.mesh_to_sdf_texture([["a", "b", "c"]], [[0, 0, 0]]),
    "fractions": lambda: sdfrs.mesh_to_sdf_texture(V, F.astype(float)),
    "a file and faces": lambda: sdfrs.mesh_to_sdf_texture("a.obj", F),
    "sparse": lambda: sdfrs.mesh_to_sdf_texture(V, F, sparse="yes"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_types(name):
    with pytest.raises(TypeError):
        WRONG[name]()


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(sdfrs.MissingFileError, match="no file"):
        sdfrs.mesh_to_sdf_texture(tmp_path / "no.obj")


@pytest.mark.parametrize("ending", ["obj", "stl", "ply", "off", "glb", "xyz"])
@pytest.mark.parametrize("garbage", [b"", b"\0" * 300, b"hello\nworld\n", bytes(range(256)) * 4])
def test_garbage_files(ending, garbage, tmp_path):
    path = tmp_path / f"bad.{ending}"
    path.write_bytes(garbage)
    with pytest.raises(sdfrs.MeshError) as caught:
        sdfrs.mesh_to_sdf_texture(path)
    assert f"bad.{ending}" in str(caught.value)


def test_claims_are_compared_with_the_file(tmp_path):
    (tmp_path / "bomb.stl").write_bytes(b"\0" * 80 + (2**31).to_bytes(4, "little") + b"\0" * 50)
    (tmp_path / "bomb.off").write_text("OFF\n3 2147483648 0\n0 0 0\n")
    (tmp_path / "bomb.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"
    )
    for name in ("bomb.stl", "bomb.off", "bomb.ply"):
        with pytest.raises(sdfrs.MeshError, match=name):
            sdfrs.mesh_to_sdf_texture(tmp_path / name)


def test_progress_is_told():
    seen = []
    sdfrs.mesh_to_sdf_texture(V, F, resolution=64, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (64**3, 64**3) and all(a[0] <= b[0] for a, b in zip(seen, seen[1:]))


def test_the_command_line(tmp_path):
    (tmp_path / "ball.obj").write_text(
        "\n".join([f"v {x} {y} {z}" for x, y, z in V] + ["f " + " ".join(str(i + 1) for i in f) for f in POLYGONS])
        + "\n"
    )
    run = lambda *words: subprocess.run(
        [sys.executable, "-m", "sdfrs", *words], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    done = run("convert", "ball.obj", "-o", "ball.npz", "--resolution", "33", "--sparse", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["dims"] == [33, 33, 33] and told["sparse"] and told["report"]["watertight"]
    done = run("render", "ball.npz", "--size", "64x48", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["summary"]["hits"] > 200 and (tmp_path / "ball.png").exists()
    done = run("convert", "csg", "--resolution", "20x21x22", "--bounds", "-1", "-1", "-1", "1", "1", "1")
    assert done.returncode == 0 and "20 x 21 x 22 nodes" in done.stdout, done.stderr
    done = run("convert", "ball.obj", "--resolution", "0")
    assert done.returncode == 1 and "resolution" in done.stderr
    assert run("convert", "ball.obj", "--resolution", "1x2").returncode == 2
