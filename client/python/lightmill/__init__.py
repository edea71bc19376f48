"""Client of Lightmill render farms.

    from lightmill import Farm

    farm = Farm("http://localhost:7071")
    job = farm.submit("scene.pbrt", spp=64)
    for status in job.watch():
        print(status.state.value, status.spp, status.relmse)
    pixels = job.image()          # numpy, float32, height x width x 3, linear Rec.709
    job.save("picture.exr")

It speaks the coordinator's HTTP API (docs/http-api.md) with Python's standard library alone; only `Job.image` needs
numpy. All errors are `LightmillError`s. `AsyncFarm` has the same verbs for asyncio.
"""
from .aio import AsyncFarm, AsyncJob, AsyncSequence
from .errors import (AlreadyExists, FailedPrecondition, InvalidArgument, JobFailed, LightmillError, NotFound,
                     PermissionDenied, ResourceExhausted, SequenceFailed, ServerError, Unauthenticated, Unreachable,
                     WaitTimeout)
from .farm import Farm
from .job import Job
from .model import (BoxError, DropKind, DroppedContributions, ErrorCurve, ErrorPoint, FrameCounts, FrameStatus,
                    JobState, JobStatus, LogLine, RenderCounters, SequenceStatus, TileState, TileStatus, WorkerState,
                    WorkerStatus)
from .picture import Picture
from .scenes import SceneCheck
from .sequence import Sequence

__all__ = [
    "AlreadyExists", "AsyncFarm", "AsyncJob", "AsyncSequence", "BoxError", "DropKind", "DroppedContributions", "ErrorCurve",
    "ErrorPoint", "FailedPrecondition", "Farm", "FrameCounts", "FrameStatus", "InvalidArgument", "Job", "JobFailed", "JobState", "JobStatus",
    "LightmillError", "LogLine", "NotFound", "PermissionDenied", "Picture", "RenderCounters", "ResourceExhausted",
    "SceneCheck", "Sequence", "SequenceFailed", "SequenceStatus", "ServerError", "TileState", "TileStatus", "Unauthenticated", "Unreachable", "WaitTimeout",
    "WorkerState", "WorkerStatus",
]
__version__ = "0.1.0"
