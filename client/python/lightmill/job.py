"""One job of a farm."""
from __future__ import annotations

import contextlib
import os
import pathlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal, overload

from .errors import InvalidArgument, JobFailed, Unreachable
from .following import last_state, message_of, states
from .model import ErrorCurve, JobStatus, LogLine, TileStatus, from_json
from .picture import Picture, picture_of
from .transport import Answer, Path, Transport

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

PICTURE_SECONDS = 300.0  # until the first byte of a picture
PICTURE_TRIES = 3


class Job:
    """A handle. It asks the coordinator at every call; nothing is kept here but the id."""

    def __init__(self, transport: Transport, job_id: str, *, reconnect_seconds: float = 60.0,
                 warnings: tuple[str, ...] = ()) -> None:
        self._transport = transport
        self._reconnect_seconds = reconnect_seconds
        self.id = job_id
        self.warnings = warnings  # of the scene, when it was submitted

    def __repr__(self) -> str:
        return f"Job({self.id!r})"

    def _path(self, rest: str = "") -> str:
        return f"/v1/jobs/{self.id}{rest}"

    def _scoped(self, transport: Transport) -> Job:
        return Job(transport, self.id, reconnect_seconds=self._reconnect_seconds, warnings=self.warnings)

    def status(self) -> JobStatus:
        """The job as it is now. Raises NotFound for an unknown one."""
        return from_json(JobStatus, self._transport.call("GET", self._path()).get("job"))

    # Following it.

    def watch(self) -> Iterator[JobStatus]:
        """The status at once, after every change and now and then; the last one is final. When the coordinator is lost it
        goes on with the one that leads then. Raises Unreachable if none does for the farm's `reconnect_seconds`."""
        return states(self._transport, self._path(":watch"), lambda said: from_json(JobStatus, said.get("job")),
                      self._reconnect_seconds)

    def wait(self, timeout: float | None = None) -> JobStatus:
        """Waits until the job is done and returns its last status. Raises JobFailed if it fails or is cancelled,
        WaitTimeout after `timeout` seconds."""
        return last_state(f"job {self.id}", self.watch(), timeout, JobFailed)

    # Its picture.

    def file(self, format: Literal["exr", "png", "raw"] = "exr", *, aovs: bool = False, max_side: int = 0,
             for_display: bool = False, view: str = "", exposure: float = 0.0) -> bytes:
        """The picture so far as the bytes of a file. `max_side` > 0: a preview with at most so many pixels a side.
        `view` and `exposure` (stops) are of a PNG, as those of `lightmill fetch`."""
        query: dict[str, Any] = {"format": format, "with_aovs": aovs, "max_side": max_side, "for_display": for_display,
                                 "view": view or None, "exposure": exposure}
        for _ in range(PICTURE_TRIES - 1):
            answer = self._transport.open("GET", self._path("/image"), query=query, timeout=PICTURE_SECONDS)
            with contextlib.suppress(Unreachable):  # a coordinator in need of memory cuts the slowest off
                return answer.read()
            self._transport.scope.check()
        return self._transport.open("GET", self._path("/image"), query=query, timeout=PICTURE_SECONDS).read()

    def picture(self, *, aovs: bool = False, max_side: int = 0, for_display: bool = False) -> Picture:
        """The picture so far as floats, without numpy."""
        return picture_of(self.file("raw", aovs=aovs, max_side=max_side, for_display=for_display))

    @overload
    def image(self, *, aovs: Literal[False] = False, max_side: int = 0) -> NDArray[numpy.float32]: ...

    @overload
    def image(self, *, aovs: Literal[True]) -> dict[str, NDArray[numpy.float32]]: ...

    def image(self, *, aovs: bool = False,
              max_side: int = 0) -> NDArray[numpy.float32] | dict[str, NDArray[numpy.float32]]:
        """The picture so far as numpy's float32: height x width x 3, linear Rec.709, from the top. With `aovs` a dict of
        these: "rgb", and the AOVs by name ("albedo", "normal", ...), each height x width x channels. Needs numpy."""
        picture = self.picture(aovs=aovs, max_side=max_side)
        values = picture.array()
        if not aovs:
            return values[:, :, :3]
        groups: dict[str, list[int]] = {}
        for i, channel in enumerate(picture.channels):
            groups.setdefault("rgb" if i < 3 else channel.rsplit(".", 1)[0], []).append(i)
        return {name: values[:, :, channels] for name, channels in groups.items()}

    def save(self, path: Path, *, aovs: bool = False, max_side: int = 0, view: str = "", exposure: float = 0.0) -> None:
        """Writes the picture so far: .exr (with `aovs` as layers), .png (as `view` and `exposure` say), or .raw. A
        reader never sees half a file. Raises InvalidArgument for another extension, OSError if it can't be written."""
        target = pathlib.Path(path)
        format = target.suffix.lower().lstrip(".")
        if format not in ("exr", "png", "raw"):
            raise InvalidArgument(f"{os.fspath(path)}: the extension must be .exr, .png or .raw")
        data = self.file(format, aovs=aovs, max_side=max_side, view=view, exposure=exposure)  # type: ignore[arg-type]
        beside = target.with_name(f"{target.name}.{os.getpid()}.part")
        try:
            beside.write_bytes(data)
            os.replace(beside, target)
        finally:
            beside.unlink(missing_ok=True)

    # What else there is to know.

    def curve(self) -> ErrorCurve:
        """Error against run time so far."""
        return from_json(ErrorCurve, self._transport.call("GET", self._path("/curve")).get("curve"))

    def tiles(self) -> list[TileStatus]:
        """The job's ledger."""
        return [from_json(TileStatus, tile) for message in self._messages("/tiles") for tile in message["tiles"]]

    def logs(self, *, tile: int | None = None, lines: int = 1000) -> list[LogLine]:
        """The newest lines about its tiles, or about one; at most 20000, oldest first."""
        query = {"tile_id": tile, "max_lines": lines}
        return [from_json(LogLine, line) for message in self._messages("/logs", query) for line in message["lines"]]

    def _messages(self, rest: str, query: dict[str, Any] | None = None) -> Iterator[Any]:
        answer: Answer = self._transport.open("GET", self._path(rest), query=query)
        try:
            while line := answer.line():
                yield message_of(line)
        finally:
            answer.close()

    # Control. Each returns the status after it, and raises FailedPrecondition where the state does not allow it.

    def _act(self, verb: str, **fields: Any) -> JobStatus:
        body = {name: value for name, value in fields.items() if value is not None}
        return from_json(JobStatus, self._transport.call("POST", self._path(":" + verb), body=body).get("job"))

    def pause(self) -> JobStatus:
        """Hands out no more work of it."""
        return self._act("pause")

    def resume(self) -> JobStatus:
        """Undoes `pause`."""
        return self._act("resume")

    def cancel(self) -> JobStatus:
        """Ends it; what was rendered stays."""
        return self._act("cancel")

    def retry(self) -> JobStatus:
        """Starts a failed or cancelled job again from where it stopped."""
        return self._act("retry")

    def set_priority(self, priority: int) -> JobStatus:
        """Higher first. Of a job that has not ended and is no frame of a sequence."""
        return self._act("setPriority", priority=priority)

    def extend(self, *, spp: int | None = None, time: float | None = None,
               target_error: float | None = None) -> JobStatus:
        """Sets new totals and reopens a finished job. `time` in seconds; 0 for `time` or `target_error`: none."""
        return self._act("extend", spp=spp, time_seconds=time, target_error=target_error)
