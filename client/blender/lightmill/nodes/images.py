"""Writes images of Blender below the export's folder, named by their content."""
from __future__ import annotations

import hashlib
import os
import pathlib
import re
import shutil
from dataclasses import dataclass
from typing import Any

from .report import Report

# What the renderer reads as it is.
KNOWN = {".png": ".png", ".jpg": ".jpg", ".jpeg": ".jpg", ".exr": ".exr", ".hdr": ".hdr", ".tif": ".tif", ".tiff": ".tif", ".tga": ".tga",
         ".bmp": ".bmp", ".webp": ".webp"}
_MAGIC = ((b"\x89PNG", ".png"), (b"\xff\xd8\xff", ".jpg"), (b"\x76\x2f\x31\x01", ".exr"), (b"#?", ".hdr"), (b"II*\0", ".tif"),
          (b"MM\0*", ".tif"), (b"BM", ".bmp"))
MOST_PIXELS = 1 << 28
_LINEAR = {"Linear", "Linear Rec.709", "scene_linear", "Non-Color", "Raw", "Generic Data", "Linear BT.709"}
_DATA = {"Non-Color", "Raw", "Generic Data"}


@dataclass(frozen=True)
class ImageFile:
    """A file in the export's folder."""

    name: str  # relative to the folder
    colorspace: str  # "sRGB", "Linear" or "Non-Color", as a texture graph has it
    alpha: str  # "none", "straight", "multiplied" (colours are multiplied by it) or "data" (it is a fourth channel)


class ImageFiles:
    """Writes each image once. `files` gets the names."""

    def __init__(self, folder: pathlib.Path, files: set[str], report: Report, memory: dict[Any, Any] | None = None) -> None:
        self.folder, self.files, self.report = folder, files, report
        self._done: dict[Any, ImageFile | None] = {}
        self._by_file: dict[Any, str] = memory if memory is not None else {}

    def write(self, image: Any, frame: int, user: Any = None, *, owner: str = "", node: str = "", tile: int | None = None,
              multiplied: bool = False) -> ImageFile | None:
        """The file of an image at a frame; None (reported) if it can't be had. `user` is the node's ImageUser, of a sequence;
        `tile` the number of a UDIM tile. With `multiplied` colours are multiplied by a straight alpha as Cycles does, in the
        encoding of the file, and there is no alpha."""
        number = _sequence_number(image, user, frame) if image.source == "SEQUENCE" else tile
        key = (image.as_pointer(), number, multiplied)
        if key not in self._done:
            try:
                found = self._written(image, number, owner, node)
                if multiplied and found is not None and found.alpha == "straight":
                    found = self._multiplied(image, found, number, owner, node)
                self._done[key] = found
            except OSError as error:
                self.report.add(f"image {image.name}", owner, node, f"the image {image.name!r} can't be read: {error}")
                self._done[key] = None
            except RuntimeError as error:
                self.report.add(f"image {image.name}", owner, node, f"the image {image.name!r} has no picture: {error}")
                self._done[key] = None
        return self._done[key]

    def write_bytes(self, data: bytes, extension: str) -> str:
        """A file of that content; gives its name relative to the folder."""
        name = f"images/{hashlib.sha256(data).hexdigest()[:40]}{extension}"
        path = self.folder / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        self.files.add(name)
        return name

    def write_copy(self, path: pathlib.Path, extension: str) -> str:
        """A copy of a file, by its content."""
        stat = path.stat()
        key = ("image file", str(path), stat.st_mtime_ns, stat.st_size)
        if key not in self._by_file:
            sha = hashlib.sha256()
            with open(path, "rb") as file:
                while block := file.read(1 << 20):
                    sha.update(block)
            self._by_file[key] = sha.hexdigest()
        name = f"images/{self._by_file[key][:40]}{extension}"
        target = self.folder / name
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            partial = target.with_name(target.name + f".{os.getpid()}.part")
            shutil.copyfile(path, partial)
            os.replace(partial, target)
        self.files.add(name)
        return name

    def _written(self, image: Any, number: int | None, owner: str, node: str) -> ImageFile | None:
        if image.source in ("FILE", "SEQUENCE", "TILED") and not image.is_dirty:
            packed = _packed(image, number)
            if packed is not None:
                extension = _extension_of(packed, image.filepath)
                if extension:
                    return self._as_file(image, self.write_bytes(packed, extension))
            else:
                path = _path(image, number)
                if not path.is_file():
                    self.report.add(f"image {image.name}", owner, node, f"the image {image.name!r} is missing ({path}); it is drawn in magenta",
                                    lasting=True)
                    return None
                extension = KNOWN.get(path.suffix.lower())
                if extension:
                    return self._as_file(image, self.write_copy(path, extension))
        if image.source == "MOVIE":
            self.report.add(f"image {image.name}", owner, node, "a movie as a texture shows the frame that Blender has loaded")
        return self._from_pixels(image, owner, node)

    def _from_pixels(self, image: Any, owner: str, node: str) -> ImageFile | None:
        import numpy

        from . import image_files

        width, height = image.size
        if not 0 < width * height <= MOST_PIXELS:
            self.report.add(f"image {image.name}", owner, node, f"the image {image.name!r} has no pixels (or too many); it is drawn in magenta")
            return None
        channels = image.channels
        pixels = numpy.empty(width * height * channels, numpy.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, channels)[::-1]
        if channels < 3:
            pixels = numpy.repeat(pixels[:, :, :1], 3, axis=2)
        if image.is_float:
            # Blender has these in linear colours, multiplied by alpha.
            name = self.write_bytes(image_files.exr(numpy.ascontiguousarray(pixels)), ".exr")
            return ImageFile(name, "Linear", _alpha(image, "multiplied") if channels == 4 else "none")
        name = self.write_bytes(image_files.png((numpy.clip(pixels, 0, 1) * 255 + 0.5).astype(numpy.uint8)), ".png")
        return ImageFile(name, _colorspace(image), _alpha(image, "straight") if channels == 4 else "none")

    def _multiplied(self, image: Any, straight: ImageFile, number: int | None, owner: str, node: str) -> ImageFile:
        import numpy

        from . import image_files

        width, height = image.size
        if image.source in ("SEQUENCE", "TILED") or image.channels != 4 or not 0 < width * height <= MOST_PIXELS:
            return straight
        pixels = numpy.empty(width * height * 4, numpy.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, 4)[::-1]
        if image.is_float or (pixels[:, :, 3] >= 1).all():
            return ImageFile(straight.name, straight.colorspace, "none" if not image.is_float else straight.alpha)
        colors = (pixels[:, :, :3] * pixels[:, :, 3:] * 255 + 0.5).astype(numpy.uint8)
        return ImageFile(self.write_bytes(image_files.png(colors), ".png"), straight.colorspace, "none")

    def _as_file(self, image: Any, name: str) -> ImageFile:
        space = _colorspace(image)
        if space == "":
            self.report.add(f"colour space {image.name}", image.name, "", f"the colour space {image.colorspace_settings.name!r} is taken as linear")
            space = "Linear"
        return ImageFile(name, space, _alpha(image, {"STRAIGHT": "straight", "PREMUL": "multiplied"}.get(image.alpha_mode, "straight")))


def _colorspace(image: Any) -> str:
    name = image.colorspace_settings.name
    if name in _DATA:
        return "Non-Color"
    return "sRGB" if name == "sRGB" else "Linear" if name in _LINEAR else ""


def _alpha(image: Any, usual: str) -> str:
    """How colours and alpha belong together."""
    if image.alpha_mode == "NONE":
        return "none"
    if image.alpha_mode == "CHANNEL_PACKED" or _colorspace(image) == "Non-Color":
        return "data"
    return usual if image.depth in (0, 32, 64, 128) else "none"  # bits of a pixel that may have alpha


def _packed(image: Any, number: int | None) -> bytes | None:
    files = list(image.packed_files)
    if not files:
        return None
    if image.source == "TILED" and number is not None:
        files = [f for f in files if getattr(f, "tile_number", number) == number]
        if not files:
            return None
    return bytes(files[0].packed_file.data) if files[0].packed_file else None


def _extension_of(data: bytes, path: str) -> str:
    for magic, extension in _MAGIC:
        if data.startswith(magic):
            return extension
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return ".webp"
    return ".tga" if path.lower().endswith(".tga") else ""


def _path(image: Any, number: int | None) -> pathlib.Path:
    import bpy

    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == "SEQUENCE" and number is not None:
        folder, name = os.path.split(path)
        found = list(re.finditer(r"\d+", os.path.splitext(name)[0]))
        if found:
            at = found[-1]
            path = os.path.join(folder, name[:at.start()] + str(number).zfill(at.end() - at.start()) + name[at.end():])
    elif image.source == "TILED" and number is not None:
        column, row = (number - 1001) % 10, (number - 1001) // 10
        path = path.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")
    return pathlib.Path(path)


def _sequence_number(image: Any, user: Any, frame: int) -> int:
    """The number in the file's name, as Blender counts."""
    if user is None:
        return 1
    length = max(user.frame_duration, 1)
    at = frame - user.frame_start + 1
    if user.use_cyclic:
        at = (at - 1) % length + 1
    return min(max(at, 1), length) + user.frame_offset
