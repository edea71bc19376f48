"""The frames of a shot or a turntable, as one thing."""
from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal

from .errors import InvalidArgument, LightmillError, SequenceFailed, ServerError
from .following import last_state, states
from .job import Job
from .model import FrameStatus, JobState, SequenceStatus, from_json
from .scenes import SceneCheck
from .transport import Path, Transport

Order = Literal["sequential", "coarse-first"]
MOST_FRAMES = 20000  # of a sequence
_PER_CALL = 1000  # of a call that adds frames
_BYTES_PER_CALL = 4 << 20
_CHANGE_SECONDS = 600.0  # of a call that changes thousands of frames
_ORDERS = {"sequential": "FRAME_ORDER_SEQUENTIAL", "coarse-first": "FRAME_ORDER_COARSE_FIRST"}


def frame_numbers(frames: str | Iterable[int]) -> list[int]:
    """"1-100", "1-100x2", "1-10,20" or numbers, each once. Raises InvalidArgument."""
    if not isinstance(frames, str):
        numbers = list(dict.fromkeys(int(number) for number in frames))
    else:
        numbers = []
        for part in frames.split(","):
            found = re.fullmatch(r"(-?\d{1,9})(?:-(-?\d{1,9}))?(?:x(\d{1,9}))?", part)
            first, last, step = (int(found[i] or d) for i, d in ((1, 0), (2, found[1]), (3, 1))) if found else (1, 0, 1)
            if last < first or step < 1 or (last - first) // step >= MOST_FRAMES:
                raise InvalidArgument(f"frames {frames!r}: expected numbers and ranges such as 1-100, 1-100x2 or 1-10,20")
            numbers += range(first, last + 1, step)
        numbers = list(dict.fromkeys(numbers))
    if not 0 < len(numbers) <= MOST_FRAMES:
        raise InvalidArgument(f"a sequence has 1 to {MOST_FRAMES} frames, not {len(numbers)}")
    return numbers


def submit_sequence(transport: Transport, bundle: Mapping[str, Any], settings_json: str, numbers: list[int], *, fps: float,
                    order: Order, budget_seconds: float, fields: Mapping[str, Any]) -> str:
    """Queues frames of one glTF file, at the times number / fps. Returns the id."""
    if order not in _ORDERS:
        raise InvalidArgument(f"order {order!r} is neither sequential nor coarse-first")
    if not fps > 0:
        raise InvalidArgument(f"fps {fps!r} is not above 0")

    def frame(number: int) -> dict[str, Any]:
        posed = {**bundle, "pose": {**bundle.get("pose", {}), "time": number / fps}}
        return {"number": number,
                "bundle_json": json.dumps(posed, sort_keys=True, separators=(",", ":"), ensure_ascii=False)}

    parts: list[list[dict[str, Any]]] = [[]]
    size = 0
    for number in numbers:
        made = frame(number)
        if parts[-1] and (len(parts[-1]) >= _PER_CALL or size + len(made["bundle_json"]) > _BYTES_PER_CALL):
            parts.append([])
            size = 0
        parts[-1].append(made)
        size += len(made["bundle_json"])
    body = {**fields, "settings_json": settings_json, "fps": fps, "order": _ORDERS[order],
            "budget_seconds": budget_seconds, "frames": parts[0]}
    sequence = transport.call("POST", "/v1/sequences", body=body, timeout=_CHANGE_SECONDS).get("sequence_id")
    if not isinstance(sequence, str) or not sequence:
        raise ServerError("the coordinator named no sequence")
    for part in parts[1:]:
        transport.call("POST", f"/v1/sequences/{sequence}:addFrames",
                       body={"settings_json": settings_json, "frames": part}, timeout=_CHANGE_SECONDS)
    return sequence


def submit_scenes(transport: Transport, frames: Iterable[tuple[int, SceneCheck]], *, fps: float,
                  fields: Mapping[str, Any]) -> str:
    """Queues frames that are scenes of their own. Returns the id."""
    sequence = ""
    try:
        for number, check in frames:
            if check.errors:
                raise InvalidArgument(check.errors[0])
            frame = {"number": number, "bundle_json": check.bundle_json, "settings_json": check.settings_json}
            if sequence:
                transport.call("POST", f"/v1/sequences/{sequence}:addFrames", body={"frames": [frame]},
                               timeout=_CHANGE_SECONDS)
                continue
            body = {**fields, "settings_json": check.settings_json, "fps": fps, "frames": [frame]}
            sequence = str(transport.call("POST", "/v1/sequences", body=body, timeout=_CHANGE_SECONDS).get("sequence_id") or "")
            if not sequence:
                raise ServerError("the coordinator named no sequence")
    except BaseException:
        if sequence:
            with contextlib.suppress(LightmillError):
                transport.call("POST", f"/v1/sequences/{sequence}:cancel", body={}, timeout=_CHANGE_SECONDS)
        raise
    if not sequence:
        raise InvalidArgument("a sequence has at least one frame")
    return sequence


class Sequence:
    """A handle. It asks the coordinator at every call; nothing is kept here but the id."""

    def __init__(self, transport: Transport, sequence_id: str, *, reconnect_seconds: float = 60.0,
                 warnings: tuple[str, ...] = ()) -> None:
        self._transport = transport
        self._reconnect_seconds = reconnect_seconds
        self.id = sequence_id
        self.warnings = warnings  # of the scene, when it was submitted

    def __repr__(self) -> str:
        return f"Sequence({self.id!r})"

    def _path(self, rest: str = "") -> str:
        return f"/v1/sequences/{self.id}{rest}"

    def _scoped(self, transport: Transport) -> Sequence:
        return Sequence(transport, self.id, reconnect_seconds=self._reconnect_seconds, warnings=self.warnings)

    def status(self) -> SequenceStatus:
        """The sequence as it is now. Raises NotFound for an unknown one."""
        return from_json(SequenceStatus, self._transport.call("GET", self._path()).get("sequence"))

    def frames(self, *, since: int = 0) -> Iterator[FrameStatus]:
        """Its frames in the order of their numbers; with `since` those whose `version` is larger."""
        token: str | None = None
        while token != "":
            page = self._transport.call("GET", self._path("/frames"), query={"page_token": token, "since_version": since})
            for frame in page.get("frames", []):
                yield from_json(FrameStatus, frame)
            token = str(page.get("next_page_token", ""))

    def frame(self, number: int) -> Job:
        """The job of a frame: its picture, its error, its tiles."""
        return Job(self._transport, f"{self.id}.{number}", reconnect_seconds=self._reconnect_seconds)

    def watch(self) -> Iterator[SequenceStatus]:
        """As Job.watch."""
        return states(self._transport, self._path(":watch"),
                      lambda said: from_json(SequenceStatus, said.get("sequence")), self._reconnect_seconds)

    def wait(self, timeout: float | None = None) -> SequenceStatus:
        """Waits until all frames are done and returns the last status. Raises SequenceFailed if one failed or was
        cancelled, WaitTimeout after `timeout` seconds."""
        return last_state(f"sequence {self.id}", self.watch(), timeout, SequenceFailed)

    def save(self, pattern: Path, *, aovs: bool = False, view: str = "", exposure: float = 0.0) -> list[str]:
        """Writes the frames that are done, as Job.save, and returns the names of their files. `pattern` has the place of
        the number: "shot.%04d.exr" or "shot.####.exr"."""
        text = re.sub(r"#+", lambda marks: f"%0{len(marks[0])}d", os.fspath(pattern))
        try:
            if text % 1 == text % 2:
                raise TypeError
        except (TypeError, ValueError):
            raise InvalidArgument(f"{os.fspath(pattern)}: name files as shot.%04d.exr or shot.####.exr") from None
        written = []
        for frame in self.frames():
            if frame.state is JobState.DONE:
                self.frame(frame.number).save(text % frame.number, aovs=aovs, view=view, exposure=exposure)
                written.append(text % frame.number)
        return written

    # Control of all frames whose state allows it. Each returns the status after it; FailedPrecondition if none does.

    def _act(self, verb: str, **fields: Any) -> SequenceStatus:
        body = {name: value for name, value in fields.items() if value is not None}
        said = self._transport.call("POST", self._path(":" + verb), body=body, timeout=_CHANGE_SECONDS)
        return from_json(SequenceStatus, said.get("sequence"))

    def pause(self) -> SequenceStatus:
        """Hands out no more work of it."""
        return self._act("pause")

    def resume(self) -> SequenceStatus:
        """Undoes `pause`."""
        return self._act("resume")

    def cancel(self) -> SequenceStatus:
        """Ends all frames; what was rendered stays."""
        return self._act("cancel")

    def retry(self) -> SequenceStatus:
        """Starts failed and cancelled frames again from where they stopped."""
        return self._act("retry")

    def extend(self, *, spp: int | None = None, time: float | None = None,
               target_error: float | None = None) -> SequenceStatus:
        """Sets new totals of each frame and reopens finished ones."""
        return self._act("extend", spp=spp, time_seconds=time, target_error=target_error)

    def set_priority(self, priority: int) -> SequenceStatus:
        """Higher first."""
        return self._act("setPriority", priority=priority)
