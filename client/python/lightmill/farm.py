"""A farm: where jobs are submitted and found."""
from __future__ import annotations

import copy
import json
import os
import pathlib
import re
from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Sequence as TypingSequence
from typing import Any, overload

from .errors import InvalidArgument, ServerError
from .job import Job
from .model import JobStatus, SequenceStatus, WorkerStatus, from_json
from .scenes import Content, Progress, SceneCheck, SceneFiles, Uploader, _file, submit
from .sequence import Order, Sequence, frame_numbers, submit_scenes, submit_sequence
from .transport import DEFAULT_PORT, Path, Transport

PAGE = 500
_MOST_SPP = 1 << 31  # no bound: as many as there can be


class Farm:
    """The coordinator of a farm, or several of which one leads. Thread-safe.

    `url` is http(s)://HOST:PORT of the coordinator's --http, several with commas between or as a list; without it,
    $LIGHTMILL_HTTP, then http://localhost:7071. A farm with TLS wants `ca` (its authority's certificate) and a token, by
    itself or in a file; `credentials` is a folder with both, as `lightmill-coordinator grant` makes it. `cert` and `key`
    are for a proxy that asks for a client certificate. `reconnect_seconds`: how long `Job.watch` looks for a coordinator
    that is away. Nothing is sent before the first call.
    """

    def __init__(self, url: str | TypingSequence[str] | None = None, *, token: str | None = None,
                 token_file: Path | None = None, ca: Path | None = None, cert: Path | None = None,
                 key: Path | None = None, credentials: Path | None = None, reconnect_seconds: float = 60.0) -> None:
        if credentials is not None:
            folder = pathlib.Path(credentials)
            ca = ca if ca is not None else folder / "ca.crt"
            if token is None and token_file is None:
                token_file = folder / "token"
        if url is None:
            url = os.environ.get("LIGHTMILL_HTTP") or f"localhost:{DEFAULT_PORT}"
        urls = url.split(",") if isinstance(url, str) else list(url)
        self._transport = Transport([u.strip() for u in urls if u.strip()], token=token, token_file=token_file, ca=ca,
                                    cert=cert, key=key)
        self._reconnect_seconds = reconnect_seconds

    def __repr__(self) -> str:
        return f"Farm({', '.join(map(str, self._transport.addresses))})"

    def close(self) -> None:
        """Closes the connections that are kept; `with Farm(...) as farm` does it, too. Later calls make new ones."""
        self._transport.close()

    def give_up(self) -> None:
        """From another thread: ends all calls that are under way with Unreachable, soon. Later ones end so, too."""
        self._transport.scope.cancel()

    def __enter__(self) -> Farm:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _scoped(self, transport: Transport) -> Farm:
        other = copy.copy(self)
        other._transport = transport
        return other

    def job(self, job_id: str) -> Job:
        """A job by its id. It is not looked up before it is asked for something. Raises InvalidArgument for what is none."""
        if not re.fullmatch(r"[A-Za-z0-9]+(\.-?[A-Za-z0-9]+)*", job_id):
            raise InvalidArgument(f"{job_id!r} is no id of a job")
        return Job(self._transport, job_id, reconnect_seconds=self._reconnect_seconds)

    def sequence(self, sequence_id: str) -> Sequence:
        """A sequence by its id, as `job`."""
        if not re.fullmatch(r"[A-Za-z0-9]+", sequence_id):
            raise InvalidArgument(f"{sequence_id!r} is no id of a sequence")
        return Sequence(self._transport, sequence_id, reconnect_seconds=self._reconnect_seconds)

    def jobs(self, *, frames: bool = False) -> Iterator[JobStatus]:
        """All jobs, oldest first, a page at a time; with `frames` also those of sequences."""
        for row in self._pages("/v1/jobs", "jobs", {} if frames else {"without_frames": True}):
            yield from_json(JobStatus, row)

    def sequences(self) -> Iterator[SequenceStatus]:
        """All sequences, oldest first, a page at a time."""
        for row in self._pages("/v1/sequences", "sequences"):
            yield from_json(SequenceStatus, row)

    def workers(self) -> Iterator[WorkerStatus]:
        """All workers, a page at a time."""
        for row in self._pages("/v1/workers", "workers"):
            yield from_json(WorkerStatus, row)

    def _pages(self, path: str, rows: str, fields: Mapping[str, Any] | None = None) -> Iterator[Any]:
        token: str | None = None
        while token != "":
            page = self._transport.call("GET", path, query={"page_size": PAGE, "page_token": token, **(fields or {})})
            yield from page.get(rows, [])
            token = str(page.get("next_page_token", ""))

    def check(self, scene: Path, /, *, files: Mapping[str, Content] | None = None, progress: Progress | None = None,
              **options: Any) -> SceneCheck:
        """Uploads a scene and returns what the coordinator finds in it, errors and warnings. `options` as `submit`."""
        extra = dict(files or {})
        options["environment"] = _with_environment(options.get("environment"), extra)
        request = scene_request(**options)
        return SceneFiles(scene, extra).complete(self._transport, request, progress)

    def submit_checked(self, frames: Iterable[tuple[int, SceneCheck]], *, name: str, fps: float = 24.0, priority: int = 0,
                       pool: str = "", max_workers: int = 0) -> Sequence:
        """Submits scenes that `check` has read, by their frames' numbers, as one Sequence. `frames` may make them one by
        one: the farm begins with the first while the others come. If it raises, the frames before it are cancelled.
        Raises InvalidArgument if there is none, or with the first error of a scene."""
        fields = {"name": name, "priority": priority, "pool": pool, "max_workers": max_workers}
        sequence = submit_scenes(self._transport, frames, fps=fps, fields=fields)
        return Sequence(self._transport, sequence, reconnect_seconds=self._reconnect_seconds)

    @overload
    def submit(self, scene: Path, *, frames: str | Iterable[int], fps: float = 24.0, order: Order = "sequential",
               budget: float = 0.0, **options: Any) -> Sequence: ...

    @overload
    def submit(self, scene: Path, *, spp: int | None = None, time: float | None = None,
               target_error: float | None = None, target_denoised: bool = False, integrator: str | None = None, max_depth: int | None = None,
               seed: int | None = None, resolution: tuple[int, int] | None = None,
               crop: tuple[float, float, float, float] | None = None, aovs: str | None = None,
               uniform_sampling: bool = False, overrides: str | None = None, camera: str | None = None,
               environment: Path | None = None, animation: str | None = None, time_of: float | None = None,
               shutter: tuple[float, float] | None = None, strict: bool = False, missing_textures: bool = False,
               strict_lights: bool = False, name: str | None = None, priority: int = 0, pool: str | None = None,
               max_workers: int = 0, after: TypingSequence[str | Job] = (), files: Mapping[str, Content] | None = None,
               progress: Progress | None = None) -> Job: ...

    def submit(self, scene: Path, *, frames: str | Iterable[int] | None = None, **options: Any) -> Job | Sequence:
        """Submits a scene file (.pbrt, .pbrt.gz, .gltf, .glb) with all that it refers to. The coordinator reads it, so
        what is not given is as the scene says. Files that the farm has are not sent again.

        The options mean what those of `lightmill submit` mean: `time` in seconds, `target_denoised` that `target_error` is
        of the denoised image, `max_depth` 0 for unlimited,
        `resolution` (width, height) in pixels, `crop` x0, x1, y0, y1 in 0..1, `aovs` names with commas between,
        `shutter` (opens, closes) in seconds after `time_of`, `environment` an image file that lights a glTF scene.
        `files` gives files of the scene that lie elsewhere or only in memory, by their names in the scene; `scene` may
        be one of them. `progress(sent, total)` is told of bytes.

        With `frames` ("1-100", "1-100x2", or numbers) it returns a Sequence of these frames of a glTF file, at the times
        number / `fps`. `order` says which come first; `budget` is in processor seconds for all frames together.

        Raises InvalidArgument for a scene that can't be rendered (with its first error, "file:line:column: message"),
        and ResourceExhausted where a quota of the farm is met.
        """
        if frames is not None:
            return self._submit_frames(scene, frames, **options)
        return self._submit_job(scene, **options)

    def _submit_frames(self, scene: Path, frames: str | Iterable[int], *, fps: float = 24.0, order: Order = "sequential",
                       budget: float = 0.0, files: Mapping[str, Content] | None = None, progress: Progress | None = None,
                       name: str | None = None, priority: int = 0, pool: str | None = None, max_workers: int = 0,
                       after: TypingSequence[str | Job | Sequence] = (), **options: Any) -> Sequence:
        numbers = frame_numbers(frames)
        if pathlib.Path(os.fspath(scene)).suffix.lower() not in (".gltf", ".glb"):
            raise InvalidArgument(f"{os.fspath(scene)}: only glTF files have frames; submit other files one by one")
        if options.get("time_of") is not None:
            raise InvalidArgument("time_of and frames: the frames say the times")
        if budget > 0 and options.get("spp") is None:
            options["spp"] = _MOST_SPP
        options["time_of"] = numbers[0] / fps if fps > 0 else 0.0
        check = self.check(scene, files=files, progress=progress, **options)
        if check.errors:
            raise InvalidArgument(check.errors[0])
        fields = {"name": name or pathlib.Path(os.fspath(scene)).stem, "priority": priority, "pool": pool or "",
                  "max_workers": max_workers, "after": [a if isinstance(a, str) else a.id for a in after]}
        sequence = submit_sequence(self._transport, json.loads(check.bundle_json), check.settings_json, numbers, fps=fps,
                                   order=order, budget_seconds=budget, fields=fields)
        return Sequence(self._transport, sequence, reconnect_seconds=self._reconnect_seconds,
                        warnings=tuple(check.warnings))

    def _submit_job(self, scene: Path, *, spp: int | None = None, time: float | None = None,
               target_error: float | None = None, target_denoised: bool = False, integrator: str | None = None, max_depth: int | None = None,
               seed: int | None = None, resolution: tuple[int, int] | None = None,
               crop: tuple[float, float, float, float] | None = None, aovs: str | None = None,
               uniform_sampling: bool = False, overrides: str | None = None, camera: str | None = None,
               environment: Path | None = None, animation: str | None = None, time_of: float | None = None,
               shutter: tuple[float, float] | None = None, strict: bool = False, missing_textures: bool = False,
               strict_lights: bool = False, name: str | None = None, priority: int = 0, pool: str | None = None,
               max_workers: int = 0, after: TypingSequence[str | Job] = (), files: Mapping[str, Content] | None = None,
               progress: Progress | None = None) -> Job:
        extra = dict(files or {})
        request = scene_request(
            spp=spp, time=time, target_error=target_error, target_denoised=target_denoised, integrator=integrator, max_depth=max_depth, seed=seed,
            resolution=resolution, crop=crop, aovs=aovs, uniform_sampling=uniform_sampling, overrides=overrides,
            camera=camera, environment=_with_environment(environment, extra), animation=animation, time_of=time_of, shutter=shutter,
            strict=strict, missing_textures=missing_textures, strict_lights=strict_lights, name=name, priority=priority,
            pool=pool, max_workers=max_workers, after=[j.id if isinstance(j, Job) else j for j in after])
        job_id, warnings = submit(self._transport, SceneFiles(scene, extra), request, progress)
        return Job(self._transport, job_id, reconnect_seconds=self._reconnect_seconds, warnings=tuple(warnings))

    def submit_bundle(self, bundle: Mapping[str, Any], settings: Mapping[str, Any], contents: TypingSequence[Content] = (), *,
                      name: str = "", priority: int = 0, pool: str = "", max_workers: int = 0,
                      progress: Progress | None = None) -> Job:
        """Submits a ready manifest and settings, which nobody reads the scene for (common/scene/bundle.h,
        common/job/settings.h; `SceneCheck` has both of a scene). `contents`: files that the manifest names by digest and that
        may not be there yet."""
        Uploader(self._transport, progress).send([_file(content) for content in contents])
        body = {"name": name, "bundle_json": _canonical(bundle), "settings_json": _canonical(settings),
                "priority": priority, "pool": pool, "max_workers": max_workers}
        job_id = self._transport.call("POST", "/v1/jobs", body=body).get("job_id")
        if not isinstance(job_id, str) or not job_id:
            raise ServerError("the coordinator named no job")
        return Job(self._transport, job_id, reconnect_seconds=self._reconnect_seconds)


def _with_environment(environment: Path | None, files: dict[str, Content]) -> str | None:
    """The name that the image has in the scene; adds it to the scene's files unless it is one of them."""
    if environment is None:
        return None
    name = os.fspath(environment)
    if name not in files:
        path = pathlib.Path(environment)
        name = f"environment/{path.name}"
        files[name] = path
    return name


def _canonical(value: Mapping[str, Any]) -> str:
    """Manifests and settings travel as JSON with sorted keys and without blanks."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def scene_request(*, time: float | None = None, resolution: tuple[int, int] | None = None,
                  crop: tuple[float, float, float, float] | None = None, shutter: tuple[float, float] | None = None,
                  **fields: Any) -> dict[str, Any]:
    """A SceneRequest (proto/lightmill/v1/thin_client.proto) as JSON, without its files. Raises InvalidArgument."""
    # Zero is a value: a seed, or a depth without limit.
    request = {name: value for name, value in fields.items()
               if value is not None and value is not False and value != "" and value != []}
    if time is not None:
        request["time_seconds"] = time
    for option, value, parts, names in (("resolution", resolution, 2, ("width", "height")),
                                        ("shutter", shutter, 2, ("shutter_opens", "shutter_closes"))):
        if value is None:
            continue
        if len(value) != parts:
            raise InvalidArgument(f"{option} has {len(value)} numbers; give {parts}")
        request.update(zip(names, value))
    if crop is not None:
        if len(crop) != 4:
            raise InvalidArgument("crop is x0, x1, y0, y1")
        request["crop"] = dict(zip(("x0", "x1", "y0", "y1"), crop))
    return request
