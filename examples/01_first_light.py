"""Six lines from a scene to a picture; writes out/first_light.png."""

from pathlib import Path

import sdfrs

drill = sdfrs.cylinder(0.45, height=4)
drills = drill | drill.orient((1, 0, 0)) | drill.orient((0, 0, 1))
shape = (sdfrs.sphere(1.0) & sdfrs.box(1.5)).difference(drills, k=0.05)
camera = sdfrs.Camera.look_at(origin=(3, 2, 4), target=(0, 0, 0), fov=30, width=960, height=540)
image = sdfrs.render(shape, camera, tracer="auto_relaxed")

out = Path(__file__).resolve().parent.parent / "out"
out.mkdir(exist_ok=True)
image.save(out / "first_light.png")
print(f"{out / 'first_light.png'}: {image.summary.hits} hits, {image.summary.mean_steps:.1f} steps per ray")
