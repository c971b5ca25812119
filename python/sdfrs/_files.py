"""Writing files whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Union

from ._errors import MissingFileError

PathLike = Union[str, "os.PathLike[str]"]


@contextmanager
def atomic(path: PathLike) -> Iterator[IO[bytes]]:
    """A file beside the target to write to, and to read back; at the end it is flushed to the disk and renamed over the target."""
    target = os.path.abspath(os.fspath(path))
    folder, name = os.path.split(target)
    temporary = os.path.join(folder, f".{name}.{os.getpid()}.part")
    if not os.path.isdir(folder):
        raise MissingFileError(f"no folder {folder!r} to write {name!r} to")
    try:
        with open(temporary, "w+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except BaseException:
        try:
            os.unlink(temporary)
        except OSError:
            pass
        raise


def atomic_write(path: PathLike, data: bytes) -> None:
    """Writes beside the target, flushes to the disk, then renames over it."""
    with atomic(path) as file:
        file.write(data)
