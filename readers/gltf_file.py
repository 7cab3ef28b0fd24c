"""Opens glTF 2.0 files: GLB containers, and JSON with buffers beside it or inside it."""

import base64
import binascii
import json
import struct
import urllib.parse
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..model.errors import UserError
from ..model.files import show
from ..model.references import MISSING, Folder, UnresolvedError
from .claims import Claims

DAMAGED = "not a readable glTF file"
READ = {
    *("KHR_mesh_quantization", "KHR_texture_transform", "KHR_draco_mesh_compression", "EXT_meshopt_compression"),
    *("KHR_meshopt_compression", "EXT_mesh_gpu_instancing", "EXT_texture_webp", "EXT_texture_avif"),
    *("KHR_materials_pbrSpecularGlossiness", "KHR_texture_basisu", "KHR_node_visibility", "CESIUM_RTC"),
}
"""Extensions that change shape or color, and are honored. KTX2 images are named in a warning."""
HARMLESS = ("KHR_materials_", "KHR_lights_", "KHR_animation_pointer", "KHR_xmp", "EXT_lights_", "KHR_audio", "VRM")
"""Beginnings of the names of extensions that change neither shape nor base color."""
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


@dataclass(eq=False)
class Gltf:
    """An open file: its JSON, and where its bytes are."""

    document: dict[str, Any]
    folder: Folder
    binary: bytes | None
    """The chunk of a GLB."""
    claims: Claims
    buffers: dict[int, bytes] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    """URI -> bytes of the file, read once."""
    views: dict[int, bytes] = field(default_factory=dict)

    def items(self, key: str) -> list[Any]:
        """Return a list of the document, such as "nodes"; empty if there is none."""
        found = self.document.get(key, [])
        return found if isinstance(found, list) else []

    def item(self, key: str, index: object) -> dict[str, Any]:
        """Return an object of a list. Raises UserError if it does not exist."""
        items = self.items(key)
        if not isinstance(index, int) or not 0 <= index < len(items) or not isinstance(items[index], dict):
            raise UserError(f"{DAMAGED} ({key}: there is no {show(str(index))[:20]})")
        found: dict[str, Any] = items[index]
        return found

    def buffer(self, index: object) -> bytes:
        """Return the bytes of a buffer. Raises UserError."""
        described = self.item("buffers", index)
        assert isinstance(index, int)
        if index not in self.buffers:
            uri = described.get("uri")
            if uri is None and index == 0 and self.binary is not None:
                self.buffers[index] = self.binary
            elif isinstance(uri, str):
                try:
                    self.buffers[index] = self.resource(uri)
                except UnresolvedError as error:
                    gone = f"its file {error.name} is not there; keep it beside the glTF"
                    raise UserError(gone if error.why == MISSING else f"its file {error}") from None
            else:
                raise UserError(f"{DAMAGED} (buffer {index} has no data)")
        return self.buffers[index]

    def resource(self, uri: str) -> bytes:
        """Return the bytes of a URI: data inside, or a file below the glTF's folder. Raises UserError."""
        if uri.startswith("data:"):
            header, _, text = uri.partition(",")
            try:
                return base64.b64decode(text) if header.endswith(";base64") else urllib.parse.unquote_to_bytes(text)
            except (binascii.Error, ValueError):
                raise UserError(f"{DAMAGED} (data that is not base64)") from None
        if uri not in self.files:
            path = self.folder.file(urllib.parse.unquote(uri))
            try:
                self.files[uri] = self.claims.read(path)
            except OSError:
                raise UnresolvedError(uri, MISSING) from None
            self.claims.take(len(self.files[uri]), "its files")
        return self.files[uri]


def extension(item: Mapping[str, Any], name: str) -> dict[str, Any] | None:
    """Return an extension of an object; None without it."""
    found = item.get("extensions")
    entry = found.get(name) if isinstance(found, dict) else None
    return entry if isinstance(entry, dict) else None


@contextmanager
def needing(name: str) -> Iterator[None]:
    """Let a missing package's error say which extension needs it."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(name, name=error.name) from None


def open_gltf(path: Path, follow: bool = False) -> Gltf:
    """Open a GLB or a glTF file. Raises UserError, and names a required extension that is not known.

    follow: of `Folder`, for buffers and images.
    """
    data = path.read_bytes()
    text, binary = _chunks(data) if data[:4] == b"glTF" else (data, None)
    try:
        document = json.loads(text.decode("utf-8-sig"))
    except (ValueError, RecursionError):
        raise UserError(f"not a readable {path.suffix[1:].upper()} file") from None
    if not isinstance(document, dict):
        raise UserError(DAMAGED)
    asset = document.get("asset")
    version = str(asset.get("version", "2.0")) if isinstance(asset, dict) else "2.0"
    if version.startswith("1"):
        raise UserError(f"glTF {show(version)[:8]}; convert it to glTF 2.0")
    for name in document.get("extensionsRequired", []):
        if name not in READ and not str(name).startswith(HARMLESS):
            raise UserError(f"it requires the extension {show(str(name))[:60]}, which this program does not know")
    return Gltf(document, Folder(path.parent, follow), binary, Claims(len(data)))


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """Return the JSON and the binary chunk of a GLB. Raises UserError."""
    if len(data) < 20 or struct.unpack("<I", data[4:8])[0] == 1:
        raise UserError("glTF 1.0, or cut off; convert it to glTF 2.0")
    at, text, binary = 12, None, None
    while at + 8 <= len(data):
        length, kind = struct.unpack("<II", data[at : at + 8])
        chunk = data[at + 8 : at + 8 + length]
        if len(chunk) < length:
            raise UserError("not a readable GLB file (it is cut off)")
        if kind == JSON_CHUNK and text is None:
            text = chunk
        elif kind == BINARY_CHUNK and binary is None:
            binary = chunk
        at += 8 + length + -length % 4
    if text is None:
        raise UserError("not a readable GLB file")
    return text, binary
