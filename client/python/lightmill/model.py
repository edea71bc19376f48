"""What the coordinator says, as dataclasses. proto/lightmill/v1/types.proto explains the fields; times are seconds.

A field that this package does not know is left out, and one that the coordinator does not know has its default, so that
both may be of another version.
"""
from __future__ import annotations

import dataclasses
import enum
import functools
import types
import typing
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class JobState(enum.Enum):
    """What a job is doing."""
    UNSPECIFIED = "unspecified"
    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def final(self) -> bool:
        """Whether nothing happens to the job by itself any more."""
        return self in (JobState.DONE, JobState.FAILED, JobState.CANCELLED)


class TileState(enum.Enum):
    """Where a tile stands."""
    UNSPECIFIED = "unspecified"
    PENDING = "pending"
    LEASED = "leased"
    COMMITTED = "committed"


class WorkerState(enum.Enum):
    """What a worker is doing."""
    UNSPECIFIED = "unspecified"
    IDLE = "idle"
    RENDERING = "rendering"
    DRAINING = "draining"
    LOST = "lost"
    REFUSED = "refused"
    BENCHED = "benched"


class DropKind(enum.Enum):
    """Why a contribution is not in the image, or not whole."""
    UNSPECIFIED = "unspecified"
    NOT_FINITE = "not_finite"
    NEGATIVE = "negative"
    OUT_OF_RANGE = "out_of_range"
    CAPPED = "capped"
    BELOW_RANGE = "below_range"


@dataclasses.dataclass(frozen=True)
class RenderCounters:
    """What the render stages counted."""
    camera_paths: int = 0
    light_paths: int = 0
    closest_hit_rays: int = 0
    shadow_rays: int = 0
    zero_connections_skipped: int = 0
    rouletted_connections: int = 0
    nonfinite: int = 0


@dataclasses.dataclass(frozen=True)
class BoxError:
    """relMSE of the means over boxes of `side` x `side` pixels, times the pixels of a box."""
    side: int = 0
    relmse: float | None = None
    relmse_low: float | None = None
    relmse_high: float | None = None
    true_relmse: float | None = None


@dataclasses.dataclass(frozen=True)
class DroppedContributions:
    """What was dropped of one kind; `share` is of the image's light, or of the samples for what is not finite."""
    kind: DropKind = DropKind.UNSPECIFIED
    count: int = 0
    share: float | None = None


@dataclasses.dataclass(frozen=True)
class JobStatus:
    """A job as it is at one moment."""
    id: str = ""
    name: str = ""
    state: JobState = JobState.UNSPECIFIED
    message: str = ""  # why it failed or waits
    settings_json: str = ""
    bundle_digest: str = ""
    priority: int = 0
    pool: str = ""
    packets_done: int = 0
    packets_total: int = 0
    tiles_committed: int = 0
    tiles_leased: int = 0
    leases_reassigned: int = 0
    spp: float = 0.0  # mean samples per pixel merged so far
    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    samples_per_second: float = 0.0
    eta_seconds: float = -1.0  # -1: unknown
    relmse: float | None = None  # estimated; the next two are its 95 % interval
    relmse_low: float | None = None
    relmse_high: float | None = None
    counters: RenderCounters = RenderCounters()
    workers: int = 0
    version: int = 0
    submitter: str = ""
    max_workers: int = 0
    after: list[str] = dataclasses.field(default_factory=list)
    commit_bytes: int = 0
    deadline: float = 0.0  # seconds since 1970; 0: none
    missing_light: list[str] = dataclasses.field(default_factory=list)
    boxes: list[BoxError] = dataclasses.field(default_factory=list)
    dropped: list[DroppedContributions] = dataclasses.field(default_factory=list)
    waiting: str = ""  # why no worker has a tile of it; empty: it does not wait
    waits_behind: str = ""  # id of the job that it waits for, of a sequence a frame's
    turn_seconds: float | None = None  # until its turn comes, about; None: unknown, or it does not wait
    denoised_relmse: float | None = None  # of the image denoised; the next two are its 95 % interval
    denoised_relmse_low: float | None = None
    denoised_relmse_high: float | None = None

    @property
    def progress(self) -> float:
        """The part that is merged, 0 to 1; 0 while the whole is not known."""
        return self.packets_done / self.packets_total if self.packets_total > 0 else 0.0


@dataclasses.dataclass(frozen=True)
class CellRect:
    """A half-open rectangle of cells of 32 x 32 pixels."""
    x0: int = 0
    y0: int = 0
    x1: int = 0
    y1: int = 0


@dataclasses.dataclass(frozen=True)
class TileSpec:
    """Cells and a range of samples."""
    cells: CellRect = CellRect()
    sample_begin: int = 0
    sample_end: int = 0


@dataclasses.dataclass(frozen=True)
class TileStatus:
    """A row of a job's ledger."""
    id: int = 0
    tile: TileSpec | None = None  # none of a pilot
    state: TileState = TileState.UNSPECIFIED
    attempt: int = 0
    worker_id: str = ""
    digest: str = ""
    pilot: bool = False


@dataclasses.dataclass(frozen=True)
class WorkerRegistration:
    """What a worker says of itself."""
    host: str = ""
    threads: int = 0
    build: str = ""
    schema: int = 0
    arithmetic_class: str = ""
    pool: str = ""
    memory_bytes: int = 0


@dataclasses.dataclass(frozen=True)
class WorkerStatus:
    """A worker as it is at one moment."""
    id: str = ""
    registration: WorkerRegistration = WorkerRegistration()
    state: WorkerState = WorkerState.UNSPECIFIED
    tiles_committed: int = 0
    samples_per_second: float = 0.0
    seconds_since_seen: float = 0.0
    partials_refused: int = 0


@dataclasses.dataclass(frozen=True)
class ErrorPoint:
    """One point of error against run time."""
    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    spp: float = 0.0
    relmse: float | None = None
    relmse_low: float | None = None
    relmse_high: float | None = None
    batches: int = 0
    true_relmse: float | None = None
    true_relmse_trimmed: float | None = None
    true_flip: float | None = None
    boxes: list[BoxError] = dataclasses.field(default_factory=list)
    denoised_relmse: float | None = None  # of the image denoised; the next two are its 95 % interval
    denoised_relmse_low: float | None = None
    denoised_relmse_high: float | None = None


@dataclasses.dataclass(frozen=True)
class ErrorCurve:
    """Error against run time."""
    job_name: str = ""
    points: list[ErrorPoint] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class LogLine:
    """What happened to a tile."""
    time: float = 0.0  # seconds since 1970
    tile_id: int = -1
    attempt: int = 0
    worker_id: str = ""
    text: str = ""


@dataclasses.dataclass(frozen=True)
class FrameCounts:
    """Frames by their state."""
    queued: int = 0
    running: int = 0
    paused: int = 0
    done: int = 0
    failed: int = 0
    cancelled: int = 0


@dataclasses.dataclass(frozen=True)
class SequenceStatus:
    """A sequence as it is at one moment. Times and packets are sums over its frames."""
    id: str = ""
    name: str = ""
    state: JobState = JobState.UNSPECIFIED  # running if a frame is, else queued, paused, failed or cancelled, else done
    message: str = ""  # which frames failed and why, or why nothing happens
    priority: int = 0
    pool: str = ""
    submitter: str = ""
    max_workers: int = 0
    after: list[str] = dataclasses.field(default_factory=list)
    fps: float = 0.0
    budget_seconds: float = 0.0  # of processors; 0: none
    deadline: float = 0.0  # seconds since 1970; 0: none
    frame_count: int = 0
    frames: FrameCounts = FrameCounts()
    first_frame: int = 0
    last_frame: int = 0
    packets_done: int = 0
    packets_total: int = 0
    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    samples_per_second: float = 0.0
    eta_seconds: float = -1.0  # -1: unknown
    relmse_mean: float | None = None
    relmse_max: float | None = None
    workers: int = 0
    version: int = 0


@dataclasses.dataclass(frozen=True)
class FrameStatus:
    """A frame among its sequence."""
    number: int = 0
    job_id: str = ""
    state: JobState = JobState.UNSPECIFIED
    message: str = ""
    spp: float = 0.0
    packets_done: int = 0
    packets_total: int = 0
    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    relmse: float | None = None
    relmse_low: float | None = None
    relmse_high: float | None = None
    version: int = 0
    bundle_digest: str = ""


@functools.lru_cache(maxsize=None)
def _hints(kind: Any) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def _enum_value(kind: type[enum.Enum], name: str) -> enum.Enum:
    """JOB_STATE_DONE -> JobState.DONE; what a newer coordinator says is the first value."""
    values = list(kind.__members__.values())
    return next((value for value in values if name.endswith("_" + value.name)), values[0])


def _value(kind: Any, json: Any) -> Any:
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        kind = next(k for k in typing.get_args(kind) if k is not type(None))
    if typing.get_origin(kind) is list:
        return [_value(typing.get_args(kind)[0], item) for item in json]
    if dataclasses.is_dataclass(kind):
        return from_json(typing.cast("type[Any]", kind), json)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return _enum_value(kind, str(json))
    make: Callable[[Any], Any] = kind
    return make(json)  # int("12"), float("NaN")


def from_json(kind: type[T], json: Any) -> T:
    """A dataclass from proto3 JSON. Raises ValueError or TypeError for what can't be meant."""
    if not isinstance(json, dict):
        raise ValueError(f"a {kind.__name__} is no {type(json).__name__}")
    hints = _hints(typing.cast(Any, kind))
    return kind(**{name: _value(hints[name], value) for name, value in json.items()
                   if name in hints and value is not None})
