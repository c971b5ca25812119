"""Is a .vol file what Mitsuba says it is? Writes one, lets Mitsuba evaluate it, and compares.

pip install mitsuba sdfrs; python benches/peers/mitsuba_vol.py
"""

import os
import tempfile

import mitsuba as mi
import numpy as np

import sdfrs


def main() -> None:
    mi.set_variant("scalar_rgb")
    shape = sdfrs.sphere(0.6).translate((0.1, 0.05, 0)) - sdfrs.box((0.5, 2.0, 0.4))
    texture = shape.to_texture((31, 40, 37), bounds=((-1, -1.1, -0.9), (1.2, 1, 1)))
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "t.vol")
        texture.save(path)
        grid = np.array(mi.VolumeGrid(path))
        np.testing.assert_array_equal(grid.reshape(texture.shape_zyx), texture.values)
        lo, hi = (np.array(corner) for corner in texture.bounds)
        to_world = mi.ScalarTransform4f().translate(lo.tolist()).scale((hi - lo).tolist())
        n = np.array(texture.shape_zyx[::-1])
        volume = mi.load_dict(
            {"type": "gridvolume", "filename": path, "to_world": to_world, "raw": True, "accel": False,
             "wrap_mode": "clamp", "filter_type": "trilinear"}
        )  # fmt: skip
        points = np.random.default_rng(1).uniform(lo, hi, (500, 3))
        want = texture.sample(points)
        # Mitsuba puts samples in the middle of its voxels: our node i lies at (i + 1/2) / n of its cube.
        inner = lo + (hi - lo) * (((points - lo) / (hi - lo)) * (n - 1) + 0.5) / n
        got = []
        for p in inner:
            si = mi.Interaction3f()
            si.p = p.tolist()
            got.append(float(volume.eval_1(si)))
        print(f"{len(points)} points, largest difference {np.abs(np.array(got) - want).max():.2g}")
        assert np.abs(np.array(got) - want).max() < 1e-5


if __name__ == "__main__":
    main()
