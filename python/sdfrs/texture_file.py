"""Files of textures: .npz in and out, raw samples and Mitsuba's grid volume out; docs/texture-format.md.

An .npz is a zip file of arrays. It may come from a stranger: nothing is unpickled, every size is taken from
the zip's directory and compared with the memory before it is read, and only numbers of known types pass.
Samples are written in slabs, so a large texture needs no second copy.
"""

from __future__ import annotations

import dataclasses
import io
import json
import math
import os
import struct
import sys
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import IO, TYPE_CHECKING, Any, Optional

import numpy as np

from . import _core
from ._errors import FormatError, SceneError
from ._files import PathLike, atomic
from .mesh import MeshReport
from .texture import STEPPINGS, SdfTexture, facts_of

if TYPE_CHECKING:
    import numpy.typing as npt

VERSION = 1
ENDINGS = (".npz", ".raw", ".vol")
# Bytes that are copied at a time: few beside a texture, and soon enough for Ctrl-C; large enough for the disk.
_SLAB = 1 << 20
# {member: allowed types}; every other member is refused.
_MEMBERS = {
    "sdfrs_texture": ("<i8",),
    "values": ("<f2", "<f4", "<f8"),
    "bounds": ("<f8",),
    "dims": ("<i8",),
    "table": ("<u4",),
    "far": ("<f4",),
    "nodes": ("<f2", "<f4", "|u1"),
    "scale": ("<f4",),
    "slopes": ("<f4",),
    "lipschitz": ("<f8",),
    "max_error": ("<f8",),
    "stepping": ("|u1",),
    "report": ("|u1",),
    "confidence": ("<f4",),
}


def save(texture: SdfTexture, path: PathLike) -> None:
    """Writes a texture in the format that the name's ending says."""
    ending = os.path.splitext(os.fspath(path))[1].lower()
    writer = {".npz": _save_npz, ".raw": _save_raw, ".vol": _save_vol}.get(ending)
    if writer is None:
        raise SceneError(f"save: a texture's file must end in {', '.join(ENDINGS)}, got {os.fspath(path)!r}")
    writer(texture, path)


@dataclass(frozen=True)
class _Part:
    """An array to be written: its numbers in slabs, one after the other."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    slabs: Iterable[npt.NDArray[Any]]

    def bytes(self) -> Iterator[memoryview]:
        """Little-endian bytes, C order."""
        kind = self.dtype.newbyteorder("<")
        return (np.ascontiguousarray(slab, dtype=kind).reshape(-1).view(np.uint8).data for slab in self.slabs)


def _spans(count: int, each: int) -> Iterator[tuple[int, int]]:
    """All of `count` things of `each` bytes in spans of about a slab."""
    step = max(1, _SLAB // each)
    return ((first, min(first + step, count)) for first in range(0, count, step))


def _samples(texture: SdfTexture) -> _Part:
    """Samples of a dense texture, x fastest, or the nodes of a sparse one's bricks."""
    nz, ny, nx = texture.shape_zyx
    shape = (texture._facts["kept"], 9, 9, 9) if texture.sparse else (nz, ny, nx)
    spans = _spans(shape[0], texture.dtype.itemsize * math.prod(shape[1:]))
    return _Part(texture.dtype, shape, (_core.texture_samples(texture._node, *span) for span in spans))


def _array_part(dtype: str, value: Any) -> _Part:
    array = np.asarray(value, dtype)
    flat = array.reshape(-1)
    return _Part(array.dtype, array.shape, (flat[a:b] for a, b in _spans(flat.size, array.itemsize)))


def _parts(texture: SdfTexture) -> dict[str, _Part]:
    """All members of a texture's .npz."""
    facts, node = texture._facts, texture._node
    counts: tuple[int, ...] = tuple(reversed(facts["bricks"]))
    each = lambda: _spans(math.prod(counts), 4)  # noqa: E731
    f4 = np.dtype(np.float32)
    parts = {
        "sdfrs_texture": _array_part("i8", VERSION),
        "bounds": _array_part("f8", [facts["lo"], facts["hi"]]),
        "max_error": _array_part("f8", facts["max_error"]),
        "slopes": _Part(f4, counts, (_core.texture_slopes(node, *span) for span in each())),
        "stepping": _text(texture.stepping),
    }
    if facts["lipschitz"] is not None:
        parts["lipschitz"] = _array_part("f8", facts["lipschitz"])
    if texture.report is not None:
        found = dataclasses.replace(texture.report, confidence=None)
        parts["report"] = _text(json.dumps(asdict(found)))
        if texture.report.confidence is not None:
            parts["confidence"] = _array_part("f4", texture.report.confidence)
    if not texture.sparse:
        return {**parts, "values": _samples(texture)}
    table = (_core.texture_table(node, *span)[0] for span in each())
    parts["dims"] = _array_part("i8", facts["dims"])
    parts["table"] = _Part(np.dtype(np.uint32), counts, table)
    parts["far"] = _Part(f4, counts, (_core.texture_table(node, *span)[1] for span in each()))
    scale = _core.texture_scale(node)
    if scale is not None:
        parts["scale"] = _array_part("f4", scale)
    return {**parts, "nodes": _samples(texture)}


def _save_npz(texture: SdfTexture, path: PathLike) -> None:
    with atomic(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, part in _parts(texture).items():
            with archive.open(_member(name), "w", force_zip64=True) as out:
                descr = np.lib.format.dtype_to_descr(part.dtype.newbyteorder("<"))
                header = {"descr": descr, "fortran_order": False, "shape": part.shape}
                np.lib.format.write_array_header_2_0(out, header)  # type: ignore[no-untyped-call, unused-ignore]
                for slab in part.bytes():
                    out.write(slab)


def _member(name: str) -> zipfile.ZipInfo:
    # A fixed date, so that equal textures make equal files.
    return zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))


def _text(text: str) -> _Part:
    return _array_part("u1", np.frombuffer(text.encode(), np.uint8))


def _save_raw(texture: SdfTexture, path: PathLike) -> None:
    """Samples alone, and a header of the same name that ends in .json."""
    lo, hi = texture.bounds
    kind = np.dtype("<f4") if texture.sparse else texture.dtype.newbyteorder("<")
    header = {
        "sdfrs_texture_raw": VERSION, "data": os.path.basename(os.fspath(path)), "dtype": str(np.dtype(kind).str),
        "order": "zyx, x fastest", "shape": list(texture.shape_zyx), "lo": list(lo), "hi": list(hi),
        "spacing": list(texture.spacing), "max_error": texture.max_error,
    }  # fmt: skip
    # Both are whole before either takes its place.
    with atomic(os.path.splitext(os.fspath(path))[0] + ".json") as head, atomic(path) as file:
        head.write(json.dumps(header, indent=1).encode())
        _write_dense(texture, file, kind)


def _save_vol(texture: SdfTexture, path: PathLike) -> None:
    """Mitsuba's binary grid volume, version 3, float32, one channel; its box is that of the outermost nodes."""
    nz, ny, nx = texture.shape_zyx
    lo, hi = texture.bounds
    with atomic(path) as file:
        file.write(b"VOL\x03" + struct.pack("<iiiii6f", 1, nx, ny, nz, 1, *lo, *hi))
        _write_dense(texture, file, np.dtype("<f4"))


def _write_dense(texture: SdfTexture, file: IO[bytes], kind: np.dtype[Any]) -> None:
    """All samples, x fastest; those of a sparse texture are `to_dense`'s, in slabs: the file holds what one sweep gave the next."""
    if not texture.sparse:
        for slab in dataclasses.replace(_samples(texture), dtype=kind).bytes():
            file.write(slab)
        return
    nz, ny, nx = texture.shape_zyx
    start, layer = file.tell(), ny * nx
    spans = list(_spans(nz, 4 * layer))
    beside: Optional[npt.NDArray[np.float32]] = None
    for first, last in spans:
        values = _core.texture_unfolded(texture._node, first, last, None, beside)
        file.write(values.astype(kind, copy=False).data)
        beside = values[-layer:].copy()
    beside = None
    for first, last in reversed(spans):
        file.seek(start + 4 * layer * first)
        swept = np.frombuffer(file.read(4 * layer * (last - first)), kind).astype(np.float32, copy=False)
        values = _core.texture_unfolded(texture._node, first, last, swept, beside)
        file.seek(start + 4 * layer * first)
        file.write(values.astype(kind, copy=False).data)
        beside = values[:layer].copy()


def load_npz(path: PathLike) -> SdfTexture:
    """A texture from an .npz file; FormatError names the member that is wrong."""
    name = os.fspath(path)
    with open(name, "rb") as file:
        try:
            return _read(file)
        except (FormatError, SceneError) as error:
            raise FormatError(f"{name}: {error}") from None
        except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, struct.error, OSError) as error:
            raise FormatError(f"{name}: not a readable .npz file: {error}") from None
        except MemoryError:
            raise FormatError(f"{name}: it needs more memory than there is") from None


def _read(file: IO[bytes]) -> SdfTexture:
    with zipfile.ZipFile(file) as archive:
        found = _directory(archive)
        read = lambda key: _array(archive, found, key)  # noqa: E731
        version = int(_scalar(read("sdfrs_texture"), "sdfrs_texture"))
        if version != VERSION:
            raise FormatError(f"sdfrs_texture: got version {version}, allowed: {VERSION}")
        facts = _facts(read)
        report, confidence = read("report"), read("confidence")
        if "values" in found:
            values = _need(read("values"), "values")
            if values.ndim != 3:
                raise FormatError(f"values: got shape {values.shape}, allowed: (nz, ny, nx)")
            node = _core.texture_dense(np.ascontiguousarray(values), facts)
        else:
            node = _sparse(read, facts)
    return SdfTexture._of(node, _report(report, confidence))


def _directory(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The members by name: all known, none twice, all together within half of the memory."""
    found: dict[str, zipfile.ZipInfo] = {}
    total = 0
    for info in archive.infolist():
        key = info.filename.removesuffix(".npy")
        if key not in _MEMBERS or not info.filename.endswith(".npy"):
            raise FormatError(f"unknown member {info.filename[:60]!r}, allowed: {', '.join(_MEMBERS)}")
        if key in found:
            raise FormatError(f"{key}: there twice")
        found[key] = info
        total += info.file_size
    # While it is read it is there twice.
    allowed = _core.memory_for_samples() // 2
    if total > allowed:
        raise FormatError(f"needs {total >> 20} MiB, allowed: {allowed >> 20} MiB (a quarter of the memory)")
    return found


def _array(archive: zipfile.ZipFile, found: dict[str, zipfile.ZipInfo], key: str) -> Optional[Any]:
    """A member as an array; None where it is missing. No more is read than the directory says."""
    if key not in found:
        return None
    info = found[key]
    with archive.open(info) as member:
        head = io.BytesIO(member.read(min(info.file_size, 4096)))
        try:
            version = np.lib.format.read_magic(head)
            reader = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
            shape, fortran, dtype = reader(head, max_header_size=4000)
        except (ValueError, KeyError, TypeError, SyntaxError) as error:
            raise FormatError(f"{key}: not a .npy header: {str(error)[:100]}") from None
        if np.dtype(dtype).str not in _MEMBERS[key]:
            raise FormatError(f"{key}: got dtype {np.dtype(dtype).str!r}, allowed: {', '.join(_MEMBERS[key])}")
        if fortran and len(shape) > 1:
            raise FormatError(f"{key}: got Fortran order, allowed: C order")
        if any(not isinstance(n, int) or n < 0 for n in shape):
            raise FormatError(f"{key}: got shape {str(shape)[:60]}, allowed: whole numbers of at least 0")
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if size != info.file_size - head.tell():
            raise FormatError(f"{key}: shape {str(shape)[:60]} needs {size} bytes, got {info.file_size - head.tell()}")
        data = bytearray(size)
        view, at = memoryview(data), len(head.getbuffer()) - head.tell()
        view[:at] = head.read()
        while at < size:
            got = member.readinto(view[at : at + _SLAB])  # type: ignore[attr-defined, unused-ignore]
            if not got:
                raise FormatError(f"{key}: ends after {at} of {size} bytes")
            at += got
        member.read(1)  # the end: here the checksum is compared
    array = np.frombuffer(data, dtype).reshape(shape)
    return array if sys.byteorder == "little" else array.astype(array.dtype.newbyteorder("="))


def _need(value: Optional[Any], key: str) -> Any:
    if value is None:
        raise FormatError(f"{key}: missing")
    return value


def _scalar(value: Optional[Any], key: str) -> Any:
    if _need(value, key).shape != ():
        raise FormatError(f"{key}: got shape {_need(value, key).shape}, allowed: one number")
    return _need(value, key)[()]


def _words(value: Any, key: str) -> str:
    try:
        return bytes(np.asarray(value).reshape(-1)).decode()
    except UnicodeDecodeError:
        raise FormatError(f"{key}: not UTF-8 text") from None


def _facts(read: Any) -> dict[str, Any]:
    bounds = _need(read("bounds"), "bounds")
    if bounds.shape != (2, 3):
        raise FormatError(f"bounds: got shape {bounds.shape}, allowed: (2, 3)")
    lo, hi = (tuple(float(v) for v in row) for row in bounds)
    stepping = read("stepping")
    name = "safe" if stepping is None else _words(stepping, "stepping")
    if name not in STEPPINGS:
        raise FormatError(f"stepping: got {name[:60]!r}, allowed: {', '.join(STEPPINGS)}")
    lipschitz, error = read("lipschitz"), read("max_error")
    return facts_of(
        lo, hi, name,  # type: ignore[arg-type]
        None if lipschitz is None else float(_scalar(lipschitz, "lipschitz")),
        0.0 if error is None else float(_scalar(error, "max_error")),
    )  # fmt: skip


def _sparse(read: Any, facts: dict[str, Any]) -> _core.Node:
    dims, table = (_need(read(key), key) for key in ("dims", "table"))
    far, nodes, scale = _need(read("far"), "far"), _need(read("nodes"), "nodes"), read("scale")
    if dims.shape != (3,) or not all(2 <= n <= 2**20 for n in dims):
        raise FormatError(f"dims: got {str(dims.tolist())[:60]}, allowed: three numbers from 2 to {2**20}")
    if nodes.shape[1:] != (9, 9, 9):
        raise FormatError(f"nodes: got shape {nodes.shape}, allowed: (bricks, 9, 9, 9)")
    if (nodes.dtype == np.uint8) != (scale is not None):
        raise FormatError("scale: goes with nodes of bytes, and these with it")
    flat = lambda v: np.ascontiguousarray(v).reshape(-1)  # noqa: E731
    counts = tuple(int(n) for n in dims)
    return _core.texture_sparse(
        counts, flat(table), flat(far), flat(nodes), None if scale is None else flat(scale), facts
    )


def _report(text: Optional[Any], confidence: Optional[Any]) -> Optional[MeshReport]:
    if text is None:
        return None
    try:
        fields = json.loads(_words(text, "report"))
        lo, hi = fields["bounds"]
        return MeshReport(**{**fields, "bounds": (tuple(lo), tuple(hi)), "confidence": confidence})
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise FormatError(f"report: not what a mesh's report holds: {str(error)[:100]}") from None
