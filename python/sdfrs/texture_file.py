"""Files of textures: .npz in and out, raw samples and Mitsuba's grid volume out; docs/texture-format.md.

An .npz is a zip file of arrays. It may come from a stranger: nothing is unpickled, every size is taken from
the zip's directory and compared with the memory before it is read, and only numbers of known types pass.
Samples are written in slabs, so a large texture needs no second copy.
"""

from __future__ import annotations

import io
import json
import math
import os
import struct
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import asdict
from typing import IO, Any, Optional

import numpy as np

from . import _core
from ._errors import FormatError, SceneError
from ._files import PathLike, atomic, atomic_write
from .mesh import MeshReport
from .texture import STEPPINGS, SdfTexture, facts_of

VERSION = 1
ENDINGS = (".npz", ".raw", ".vol")
# Bytes that are copied at a time: soon enough for Ctrl-C, large enough for the disk.
_SLAB = 1 << 24
_BLOCK = 9**3
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


def _layers(texture: SdfTexture, dtype: Any) -> Iterator[bytes]:
    """All samples of a dense texture, x fastest, a slab at a time."""
    nz, ny, nx = texture.shape_zyx
    step = max(1, _SLAB // (nx * ny * 4))
    for first in range(0, nz, step):
        yield _core.texture_layers(texture._node, first, first + step).astype(dtype, copy=False).tobytes()


def _blocks(texture: SdfTexture, dtype: Any) -> Iterator[bytes]:
    """The nodes of a sparse texture's bricks, a slab at a time."""
    kept, step = texture._facts["kept"], _SLAB // (_BLOCK * 4)
    for first in range(0, kept, step):
        yield _core.texture_nodes(texture._node, first, first + step).astype(dtype, copy=False).tobytes()


def _save_npz(texture: SdfTexture, path: PathLike) -> None:
    facts = texture._facts
    small: dict[str, Any] = {
        "sdfrs_texture": np.array(VERSION, "<i8"),
        "bounds": np.array([facts["lo"], facts["hi"]], "<f8"),
        "max_error": np.array(facts["max_error"], "<f8"),
        "slopes": texture.brick_slopes.astype("<f4"),
        "stepping": _text(texture.stepping),
    }
    if facts["lipschitz"] is not None:
        small["lipschitz"] = np.array(facts["lipschitz"], "<f8")
    if texture.report is not None:
        small["report"] = _text(json.dumps({**asdict(texture.report), "confidence": None}))
        if texture.report.confidence is not None:
            small["confidence"] = texture.report.confidence.astype("<f4")
    kind = texture.dtype.newbyteorder("<")
    name, slabs = "values", _layers(texture, kind)
    shape: tuple[int, ...] = texture.shape_zyx
    if texture.sparse:
        table, far, scale = _core.texture_table(texture._node)
        counts = small["slopes"].shape
        small["dims"] = np.array(facts["dims"], "<i8")
        small["table"], small["far"] = (v.reshape(counts) for v in (table.astype("<u4"), far.astype("<f4")))
        if scale is not None:
            small["scale"] = scale.astype("<f4")
        name, shape, slabs = "nodes", (facts["kept"], 9, 9, 9), _blocks(texture, kind)
    with atomic(path) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for key, value in small.items():
            with archive.open(_member(key), "w", force_zip64=True) as out:
                np.lib.format.write_array(out, np.asarray(value, order="C"), allow_pickle=False)
        with archive.open(_member(name), "w", force_zip64=True) as out:
            header = {"descr": np.lib.format.dtype_to_descr(kind), "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_2_0(out, header)  # type: ignore[no-untyped-call, unused-ignore]
            for slab in slabs:
                out.write(slab)


def _member(name: str) -> zipfile.ZipInfo:
    # A fixed date, so that equal textures make equal files.
    return zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))


def _text(text: str) -> Any:
    return np.frombuffer(text.encode(), np.uint8)


def _save_raw(texture: SdfTexture, path: PathLike) -> None:
    """Samples alone, and a header of the same name that ends in .json."""
    dense = texture.to_dense()
    lo, hi = dense.bounds
    kind = dense.dtype.newbyteorder("<")
    header = {
        "sdfrs_texture_raw": VERSION, "data": os.path.basename(os.fspath(path)), "dtype": str(np.dtype(kind).str),
        "order": "zyx, x fastest", "shape": list(dense.shape_zyx), "lo": list(lo), "hi": list(hi),
        "spacing": list(dense.spacing), "max_error": dense.max_error,
    }  # fmt: skip
    with atomic(path) as file:
        for slab in _layers(dense, kind):
            file.write(slab)
    atomic_write(os.path.splitext(os.fspath(path))[0] + ".json", json.dumps(header, indent=1).encode())


def _save_vol(texture: SdfTexture, path: PathLike) -> None:
    """Mitsuba's binary grid volume, version 3, float32, one channel; its box is that of the outermost nodes."""
    dense = texture.to_dense()
    nz, ny, nx = dense.shape_zyx
    lo, hi = dense.bounds
    with atomic(path) as file:
        file.write(b"VOL\x03" + struct.pack("<iiiii6f", 1, nx, ny, nz, 1, *lo, *hi))
        for slab in _layers(dense, np.dtype("<f4")):
            file.write(slab)


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
