"""Pictures as floats: the format "raw" of the HTTP API."""
from __future__ import annotations

import array
import dataclasses
import struct
import sys
from typing import TYPE_CHECKING

from .errors import ServerError

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

_MAGIC = b"LMF2"
_NUMBERS = struct.Struct("<4I")


@dataclasses.dataclass(frozen=True)
class Picture:
    """Pixels of a job. The first three channels are R, G and B, linear Rec.709; the others are AOVs."""
    width: int
    height: int
    channels: tuple[str, ...]  # names, such as "R" or "albedo.R"
    data: bytes                # 32-bit floats, little endian, channels interleaved, row by row from the top

    def floats(self) -> array.array[float]:
        """The values, height x width x channels, for programs without numpy."""
        values = array.array("f", self.data)
        if sys.byteorder == "big":
            values.byteswap()
        return values

    def array(self) -> NDArray[numpy.float32]:
        """The values as numpy's float32, height x width x channels. Needs numpy."""
        import numpy  # the only user; the rest of the package works without
        shape = (self.height, self.width, len(self.channels))
        return numpy.frombuffer(self.data, "<f4").reshape(shape).astype(numpy.float32)


def picture_of(raw: bytes) -> Picture:
    """Reads the format "raw". Raises ServerError for what is none, or is cut off."""
    if len(raw) < len(_MAGIC) + _NUMBERS.size or raw[:len(_MAGIC)] != _MAGIC:
        raise ServerError("the coordinator's picture is in no form that is known here")
    width, height, channels, name_bytes = _NUMBERS.unpack_from(raw, len(_MAGIC))
    begin = len(_MAGIC) + _NUMBERS.size
    names = tuple(raw[begin:begin + name_bytes].decode("utf-8", "replace").split("\n"))
    data = raw[begin + name_bytes:]
    if len(names) != channels or len(data) != 4 * width * height * channels:
        raise ServerError("the coordinator's picture is cut off")
    return Picture(width, height, names, data)
