"""Import time of the package over numpy's: minima of alternating fresh interpreters, bare start-up taken off."""

from __future__ import annotations

import subprocess
import sys
import time

BAR = 1.3
ROUNDS = 15


def seconds(statement: str) -> float:
    """CPU and wall time are the same here: one process, no waiting."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], check=True)
    return time.perf_counter() - start


def main() -> None:
    statements = ["pass", "import numpy", "import sdfrs"]
    best = [float("inf")] * len(statements)
    for _ in range(ROUNDS):
        best = [min(known, seconds(statement)) for known, statement in zip(best, statements, strict=True)]
    numpy, ours = best[1] - best[0], best[2] - best[0]
    missed = "" if ours <= BAR * numpy else " (missed)"
    print("| import | numpy, ms | sdfrs, ms | sdfrs / numpy | bar |\n|---|---|---|---|---|")
    print(f"| fresh interpreter | {numpy * 1e3:.1f} | {ours * 1e3:.1f} | {ours / numpy:.2f} | {BAR}{missed} |")


if __name__ == "__main__":
    main()
