"""Import time of the package over numpy's: minima of alternating fresh interpreters, bare start-up taken off."""

from __future__ import annotations

import os
import sys

BAR = 1.3
ROUNDS = 15


def seconds(statement: str) -> float:
    """CPU time of a fresh interpreter, which other processes lengthen less than the wall clock."""
    child = os.posix_spawn(sys.executable, [sys.executable, "-c", statement], os.environ)
    _, status, usage = os.wait4(child, 0)
    if status:
        sys.exit(f"`{statement}` fails in {sys.executable}")
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    # As after an installation: byte code lies ready, for an editable package as well.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
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
