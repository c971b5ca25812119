"""Writes the scene files of the demo beside this script: village.json and composition.json."""

from pathlib import Path

import sdfrs

here = Path(__file__).resolve().parent
for name in ("village", "composition"):
    path = here / f"{name}.json"
    sdfrs.load(name).save(path)
    print(f"{path.name}: {path.stat().st_size:,} bytes")
