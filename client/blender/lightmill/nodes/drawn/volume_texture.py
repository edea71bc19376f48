"""Textured volumes: inputs of their shaders over a grid, looked up by Cycles in another Blender (draw_volume.py)."""
from __future__ import annotations

import json
import pathlib
import subprocess
import tempfile
from typing import Any

from ..context import Context, digest
from ..place import Place
from . import other_blender
from .world_picture import fingerprint

SIDE = 64  # cells along each side of the object's box
MOST_KEPT = 8

# An input: names of group nodes from the root, the node's name, the socket's identifier.
Input = tuple[tuple[str, ...], str, str]
_kept: dict[str, list[Any]] = {}


def box_of(place: Place) -> tuple[list[float], list[float]]:
    """The grid's box in the object's coordinates: that of the object, and a cell more, as media fade at the edge of theirs."""
    low, high = place.box
    room = [max(b - a, 1e-6) / (SIDE - 2) for a, b in zip(low, high)]
    return [a - r for a, r in zip(low, room)], [b + r for b, r in zip(high, room)]


def looked_up(material: Any, inputs: list[Input], context: Context, place: Place) -> list[Any]:
    """Arrays [SIDE^3, 3] of the inputs' values, x running fastest. Raises OSError, RuntimeError, ValueError or
    SubprocessError."""
    low, high = box_of(place)
    half = [0.5 / place.generated[k][k] for k in range(3)]
    task = {"material": material.original.name, "name": place.name, "inputs": inputs, "n": SIDE, "low": low, "high": high,
            "texture_half": half, "texture_middle": [(0.5 - place.generated[k][3]) * 2 * half[k] for k in range(3)],
            "matrix": [list(row) for row in place.matrix_world], **other_blender.moment(context.scene, context.frame)}
    name = digest(fingerprint(material, context.frame) + json.dumps(task))
    if name not in _kept:
        found = _drawn(material, task)
        while len(_kept) >= MOST_KEPT:
            _kept.pop(next(iter(_kept)))
        _kept[name] = found
    return _kept[name]


def _drawn(material: Any, task: dict[str, Any]) -> list[Any]:
    import numpy

    with tempfile.TemporaryDirectory(prefix="lightmill-volume-") as folder:
        at = pathlib.Path(folder)
        files = other_blender.answer_of("draw_volume.py", at, material.original, task)
        return [numpy.nan_to_num(numpy.load(at / file).reshape(-1, 3).astype(float)) for file in files]


FAILURES = (OSError, RuntimeError, ValueError, subprocess.SubprocessError)
