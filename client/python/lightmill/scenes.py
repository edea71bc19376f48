"""Scenes on this machine: which files the coordinator lacks, and their way there.

The coordinator reads the scene and says what it refers to; this side sends files, by digest and in pieces, and goes on
where an upload stopped. Files may also be given in memory.
"""
from __future__ import annotations

import dataclasses
import hashlib
import io
import os
import pathlib
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, BinaryIO

from .errors import InvalidArgument, LightmillError, ResourceExhausted, ServerError
from .model import from_json
from .transport import SCENE_SECONDS, Path, Transport

PIECE_BYTES = 1 << 20
MOST_ASKED = 10_000  # digests of one question
BUSY_SECONDS = 60.0  # that a coordinator may say that it has too much to do
Content = bytes | Path
Progress = Callable[[int, int], None]


@dataclasses.dataclass(frozen=True)
class SceneCheck:
    """What the coordinator says of a scene: lines as `lightmill check` prints them, and what the scene itself says."""
    errors: list[str] = dataclasses.field(default_factory=list)
    warnings: list[str] = dataclasses.field(default_factory=list)
    files: int = 0
    bytes: int = 0
    width: int = 0
    height: int = 0
    spp: int | None = None
    max_depth: int = 0
    bundle_json: str = ""  # what Farm.submit_bundle would be told of it, as JSON
    settings_json: str = ""


@dataclasses.dataclass(frozen=True)
class _File:
    content: Content
    digest: str
    size: int


def _file(content: Content) -> _File:
    if isinstance(content, bytes):
        return _File(content, hashlib.sha256(content).hexdigest(), len(content))
    digest, size = hashlib.sha256(), 0
    try:
        with open(content, "rb") as opened:
            while part := opened.read(PIECE_BYTES):
                digest.update(part)
                size += len(part)
    except OSError as error:
        raise InvalidArgument(f"{os.fspath(content)}: can't be read ({error.strerror})") from error
    return _File(content, digest.hexdigest(), size)


def local_path(folder: pathlib.Path, reference: str) -> pathlib.Path | None:
    """The file that a scene in `folder` means by `reference`; none if it is not there. Scenes made on Windows have
    backslashes, which pathlib understands there, and which are tried as slashes elsewhere."""
    for text in (reference, reference.replace("\\", "/")):
        try:
            path = folder / text
            if path.is_file():
                return path
        except (OSError, ValueError):
            pass
    return None


class Uploader:
    """Sends files that the coordinator lacks, each once."""

    def __init__(self, transport: Transport, progress: Progress | None = None) -> None:
        self._transport, self._progress = transport, progress
        self._done, self._total = 0, 0

    def send(self, files: Iterable[_File]) -> None:
        """Raises InvalidArgument for a file that can't be read or changes meanwhile, and what calls raise."""
        by_digest = {file.digest: file for file in files}
        digests = list(by_digest)
        missing: list[str] = []
        for begin in range(0, len(digests), MOST_ASKED):
            answer = self._transport.call("POST", "/v1/blobs:missing",
                                          body={"digests": digests[begin:begin + MOST_ASKED]})
            missing += answer.get("digests", [])
        self._total += sum(by_digest[digest].size for digest in missing)
        for digest in missing:
            self._send(by_digest[digest])

    def _send(self, file: _File) -> None:
        offset = self._put(file, 0, b"")[0] if file.size > PIECE_BYTES else 0  # somebody may have begun it
        content = file.content
        if isinstance(content, bytes):
            self._pieces(file, offset, io.BytesIO(content))
            return
        try:
            with open(content, "rb") as opened:
                self._pieces(file, offset, opened)
        except OSError as error:
            if isinstance(error, LightmillError):
                raise
            raise InvalidArgument(f"{os.fspath(content)}: can't be read ({error.strerror})") from error

    def _pieces(self, file: _File, offset: int, content: BinaryIO) -> None:
        while True:
            content.seek(offset)
            data = content.read(PIECE_BYTES)
            if not data and offset < file.size:
                raise InvalidArgument(f"{_name(file)} has changed while it was sent; try again")
            offset, complete = self._put(file, offset, data)
            if self._progress is not None:
                self._progress(self._done + min(offset, file.size), self._total)
            if complete:
                break
        self._done += file.size

    def _put(self, file: _File, offset: int, data: bytes) -> tuple[int, bool]:
        """How far the file is then, and whether it is stored."""
        said = patiently(self._transport, BUSY_SECONDS, lambda: self._transport.call(
            "PUT", f"/v1/blobs/{file.digest}", query={"size": file.size, "offset": offset}, data=data))
        return int(said.get("received", 0)), bool(said.get("complete", False))


def _name(file: _File) -> str:
    return "a file" if isinstance(file.content, bytes) else os.fspath(file.content)


class SceneFiles:
    """A scene's files by the names that they have in the scene. `files` are given by the caller, in memory or by their
    paths; others are looked for beside the scene file."""

    def __init__(self, scene: Path, files: Mapping[str, Content] | None = None) -> None:
        given = dict(files or {})
        text = os.fspath(scene)
        self.folder: pathlib.Path | None = None
        self.files: dict[str, _File] = {}
        if text in given:
            self.main = text
        else:
            path = pathlib.Path(text).absolute()
            if not path.is_file():
                raise InvalidArgument(f"{text}: there is no such scene file")
            self.main, self.folder = path.name, path.parent
            self.files[self.main] = _file(path)
        for name, content in given.items():
            self.files[name] = _file(content)

    def entries(self) -> list[dict[str, Any]]:
        return [{"name": name, "digest": file.digest, "size": str(file.size)} for name, file in self.files.items()]

    def complete(self, transport: Transport, request: dict[str, Any], progress: Progress | None = None) -> SceneCheck:
        """Uploads until the scene lacks nothing that is there, and returns what the coordinator says of it then."""
        uploader = Uploader(transport, progress)
        uploader.send(self.files.values())
        while True:
            request["main"], request["files"] = self.main, self.entries()
            said = _ask(transport, "/v1/scenes:check", request)
            found: dict[str, _File] = {}
            for file in said.get("missing", []):
                reference, name = str(file.get("reference", "")), str(file.get("name", ""))
                path = local_path(self.folder, reference) if self.folder is not None else None
                if path is not None and name not in self.files:
                    found[name] = _file(path)
            if not found:
                return from_json(SceneCheck, {k: v for k, v in said.items() if k != "missing"})
            self.files.update(found)
            uploader.send(found.values())


def patiently(transport: Transport, seconds: float, call: Callable[[], Any]) -> Any:
    """A call that the coordinator refuses while it has others to do."""
    end = time.monotonic() + seconds
    while True:
        try:
            return call()
        except ResourceExhausted as error:
            if "try again" not in str(error) or time.monotonic() > end:
                raise
        transport.scope.ended.wait(1)
        transport.scope.check()


def _ask(transport: Transport, path: str, request: dict[str, Any]) -> Any:
    return patiently(transport, SCENE_SECONDS,
                     lambda: transport.call("POST", path, body=request, timeout=SCENE_SECONDS))


def submit(transport: Transport, scene: SceneFiles, request: dict[str, Any],
           progress: Progress | None) -> tuple[str, list[str]]:
    """The new job's id, and the scene's warnings. Raises InvalidArgument with the scene's first error."""
    check = scene.complete(transport, request, progress)
    if check.errors:
        more = f" (and {len(check.errors) - 1} more)" if len(check.errors) > 1 else ""
        raise InvalidArgument(check.errors[0] + more)
    said = _ask(transport, "/v1/scenes:submit", request)
    job = said.get("job_id")
    if not isinstance(job, str) or not job:
        raise ServerError("the coordinator named no job")
    return job, [str(line) for line in said.get("warnings", [])]
