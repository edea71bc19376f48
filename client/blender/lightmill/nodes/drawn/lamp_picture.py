"""Point lamps and spots that shine unevenly: IES profiles and textures, measured by Cycles in another Blender (draw_lamp.py)."""
from __future__ import annotations

import json
import pathlib
import subprocess
import tempfile
from typing import Any

from .. import image_files
from ..context import Context, digest
from . import other_blender
from .draw_world import trees
from .world_picture import fingerprint

SIDE = 512  # texels of the square picture of all directions
MOST_KEPT = 32
GREY = 1e-3  # a picture of one colour, within this part of its brightest
FAILURES = (OSError, RuntimeError, ValueError, subprocess.SubprocessError)

_kept: dict[str, Any] = {}


def pictures(lamp: Any, context: Context) -> tuple[tuple[tuple[float, float, float], str], ...]:
    """Pairs of a colour and the file of a grey picture, W/sr: what the lamp gives is their sum. Raises one of FAILURES."""
    import numpy

    picture = numpy.maximum(_measured(lamp, context), 0)
    brightest = picture.max(axis=(0, 1))
    if not brightest.max() > 0:
        return ()
    colour = picture.sum(axis=(0, 1)) / picture.sum(axis=(0, 1)).max()
    grey = picture[..., int(colour.argmax())]
    if (abs(picture - grey[..., None] * colour) <= GREY * brightest.max()).all():
        return ((tuple(colour.tolist()), _file(grey, context)),)
    single = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return tuple((single[k], _file(picture[..., k], context)) for k in range(3) if brightest[k] > 0)


def _file(grey: Any, context: Context) -> str:
    import numpy

    return context.images.write_bytes(image_files.exr(numpy.ascontiguousarray(numpy.repeat(grey[..., None], 3, axis=2), numpy.float32)), ".exr")


def _measured(lamp: Any, context: Context) -> Any:
    import numpy

    told = [lamp.type, lamp.energy, list(lamp.color), getattr(lamp, "spot_size", 0), getattr(lamp, "spot_blend", 0),
            [n.ies.as_string() for t in trees(lamp.node_tree) for n in t.nodes if n.type == "TEX_IES" and n.ies is not None]]
    name = digest(fingerprint(lamp, context.frame) + json.dumps(told))
    if name not in _kept:
        with tempfile.TemporaryDirectory(prefix="lightmill-lamp-") as folder:
            at = pathlib.Path(folder)
            task = {"lamp": lamp.original.name, "side": SIDE, **other_blender.moment(context.scene, context.frame)}
            found = numpy.load(at / other_blender.answer_of("draw_lamp.py", at, lamp.original, task))
        while len(_kept) >= MOST_KEPT:
            _kept.pop(next(iter(_kept)))
        _kept[name] = found
    return _kept[name]
