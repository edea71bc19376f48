"""A second Blender, without a window, for what Cycles alone can tell.

A render engine can't start a render or a bake of its own while Blender renders with it.
"""
from __future__ import annotations

import json
import pathlib
import subprocess
from typing import Any

PATIENCE = 600  # seconds


def answer_of(script: str, folder: pathlib.Path, data: Any, task: dict[str, Any]) -> Any:
    """Runs `script` of this folder with data.blend, which has the datablock `data`, and task.json in `folder`; gives what it
    writes to answer.json. Raises OSError, RuntimeError, ValueError or SubprocessError."""
    import bpy

    if not bpy.app.binary_path:
        raise RuntimeError("this Blender is a Python module, and another one can't be started")
    bpy.data.libraries.write(str(folder / "data.blend"), {data}, path_remap="ABSOLUTE", fake_user=True)
    (folder / "task.json").write_text(json.dumps(task), encoding="utf-8")
    command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "-P",
               str(pathlib.Path(__file__).with_name(script)), "--", str(folder)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE, check=False)
    answer = folder / "answer.json"
    if done.returncode != 0 or not answer.is_file():
        last = done.stdout.decode("utf-8", "replace").strip().splitlines()[-1:]
        raise RuntimeError(f"another Blender failed: {last[0] if last else done.returncode}")
    return json.loads(answer.read_text(encoding="utf-8"))


def moment(scene: Any, frame: int) -> dict[str, Any]:
    """What every task says of the scene."""
    return {"frame": frame, "subframe": scene.frame_subframe, "threads": scene.render.threads if scene.render.threads_mode == "FIXED" else 0}
