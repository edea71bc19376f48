"""Files for pictures that are only in Blender's memory: PNG of bytes, OpenEXR of floats."""
from __future__ import annotations

import struct
import zlib
from typing import Any

EXR_ROWS = 16  # of a block of ZIP compression


def png(pixels: Any) -> bytes:
    """8-bit PNG. `pixels`: uint8 array of shape (height, width, 3 or 4), the top row first."""
    height, width, channels = pixels.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + pixels[y].tobytes() for y in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 3)) + chunk(b"IEND", b"")


def _zipped(block: bytes) -> bytes:
    """A block of OpenEXR's ZIP compression: bytes apart by parity, differences, deflate; as it is if that is not shorter."""
    import numpy

    raw = numpy.frombuffer(block, numpy.uint8)
    apart = numpy.concatenate([raw[0::2], raw[1::2]]).astype(numpy.int16)
    apart[1:] = (apart[1:] - apart[:-1] + 128) & 255
    packed = zlib.compress(apart.astype(numpy.uint8).tobytes(), 4)
    return packed if len(packed) < len(block) else block


def exr(pixels: Any) -> bytes:
    """OpenEXR of floats, zipped. `pixels`: float32 array of shape (height, width, 3 or 4), the top row first."""
    height, width, channels = pixels.shape
    names = "ABGR"[4 - channels:]  # in the order of the alphabet

    def attribute(name: str, kind: str, data: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    channel_list = b"".join(n.encode() + b"\0" + struct.pack("<iBBBBii", 2, 0, 0, 0, 0, 1, 1) for n in names) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channel_list) + attribute("compression", "compression", b"\3")
    header += attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box)
    header += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    planes = pixels.astype("<f4", copy=False)[:, :, ["RGBA".index(n) for n in names]].transpose(0, 2, 1)
    blocks, offsets = [], []
    at = len(header) + 8 * ((height + EXR_ROWS - 1) // EXR_ROWS)
    for y in range(0, height, EXR_ROWS):
        data = _zipped(planes[y:y + EXR_ROWS].tobytes())
        blocks.append(struct.pack("<ii", y, len(data)) + data)
        offsets.append(at)
        at += len(blocks[-1])
    return header + struct.pack(f"<{len(offsets)}Q", *offsets) + b"".join(blocks)
