"""The same verbs for asyncio: each call runs in a thread of its own, and ends soon when its task is cancelled."""
from __future__ import annotations

import asyncio
import contextlib
import functools
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable
from typing import TYPE_CHECKING, Any, Concatenate, Literal, ParamSpec, TypeVar, overload

from .farm import Farm
from .job import Job
from .model import FrameStatus, JobStatus, SequenceStatus, WorkerStatus
from .scenes import SceneCheck
from .sequence import Sequence
from .transport import Path, Scope, Transport

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

P = ParamSpec("P")
T = TypeVar("T")
_END = object()


async def _in_thread(call: Callable[[], T], scope: Scope) -> T:
    """Runs `call` in a thread. If the task is cancelled, `scope` is, too, and nobody waits for the thread."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[T] = loop.create_future()

    def finish(result: Any, error: BaseException | None) -> None:
        if future.done():
            return
        if error is not None:
            future.set_exception(error)
        else:
            future.set_result(result)

    def run() -> None:
        result: Any = None
        failure: BaseException | None = None
        try:
            result = call()
        except BaseException as error:
            failure = error
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody wants it any more
            loop.call_soon_threadsafe(finish, result, failure)

    threading.Thread(target=run, name="lightmill", daemon=True).start()
    try:
        return await future
    except asyncio.CancelledError:
        scope.cancel()
        raise


async def _items(begin: Callable[[Transport], Any], transport: Transport) -> AsyncIterator[Any]:
    """What an iterator gives, whose `next` blocks."""
    scope = Scope()
    iterator = begin(transport.scoped(scope))
    try:
        while (item := await _in_thread(lambda: next(iterator, _END), scope)) is not _END:
            yield item
    finally:
        scope.cancel()


async def _of_job(job: Job, call: Callable[[Job], T]) -> T:
    scope = Scope()
    scoped = job._scoped(job._transport.scoped(scope))
    return await _in_thread(lambda: call(scoped), scope)


async def _of_sequence(sequence: Sequence, call: Callable[[Sequence], T]) -> T:
    scope = Scope()
    scoped = sequence._scoped(sequence._transport.scoped(scope))
    return await _in_thread(lambda: call(scoped), scope)


async def _of_farm(farm: Farm, call: Callable[[Farm], T]) -> T:
    scope = Scope()
    scoped = farm._scoped(farm._transport.scoped(scope))
    return await _in_thread(lambda: call(scoped), scope)


def _job_verb(method: Callable[Concatenate[Job, P], T]) -> Callable[Concatenate[AsyncJob, P], Coroutine[Any, Any, T]]:
    """The method of AsyncJob with the arguments and the words of this one of Job."""
    @functools.wraps(method)
    async def verb(self: AsyncJob, /, *args: P.args, **options: P.kwargs) -> T:
        return await _of_job(self._job, lambda job: method(job, *args, **options))
    return verb


def _sequence_verb(method: Callable[Concatenate[Sequence, P], T]
                   ) -> Callable[Concatenate[AsyncSequence, P], Coroutine[Any, Any, T]]:
    @functools.wraps(method)
    async def verb(self: AsyncSequence, /, *args: P.args, **options: P.kwargs) -> T:
        return await _of_sequence(self._sequence, lambda sequence: method(sequence, *args, **options))
    return verb


def _farm_verb(method: Callable[Concatenate[Farm, P], T]) -> Callable[Concatenate[AsyncFarm, P], Coroutine[Any, Any, T]]:
    @functools.wraps(method)
    async def verb(self: AsyncFarm, /, *args: P.args, **options: P.kwargs) -> T:
        return await _of_farm(self._farm, lambda farm: method(farm, *args, **options))
    return verb


def _submitting(method: Callable[Concatenate[Farm, P], Job]
                ) -> Callable[Concatenate[AsyncFarm, P], Coroutine[Any, Any, AsyncJob]]:
    @functools.wraps(method)
    async def verb(self: AsyncFarm, /, *args: P.args, **options: P.kwargs) -> AsyncJob:
        job = await _of_farm(self._farm, lambda farm: method(farm, *args, **options))
        return AsyncJob(job._scoped(self._farm._transport))
    return verb


class AsyncJob:
    """As Job, with the same verbs."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self.id = job.id
        self.warnings = job.warnings

    def __repr__(self) -> str:
        return f"AsyncJob({self.id!r})"

    status = _job_verb(Job.status)
    wait = _job_verb(Job.wait)
    file = _job_verb(Job.file)
    picture = _job_verb(Job.picture)
    save = _job_verb(Job.save)
    curve = _job_verb(Job.curve)
    tiles = _job_verb(Job.tiles)
    logs = _job_verb(Job.logs)
    pause = _job_verb(Job.pause)
    resume = _job_verb(Job.resume)
    cancel = _job_verb(Job.cancel)
    retry = _job_verb(Job.retry)
    set_priority = _job_verb(Job.set_priority)
    extend = _job_verb(Job.extend)

    async def watch(self) -> AsyncIterator[JobStatus]:
        """As Job.watch."""
        async for status in _items(lambda transport: self._job._scoped(transport).watch(), self._job._transport):
            yield status

    @overload
    async def image(self, *, aovs: Literal[False] = False, max_side: int = 0) -> NDArray[numpy.float32]: ...

    @overload
    async def image(self, *, aovs: Literal[True]) -> dict[str, NDArray[numpy.float32]]: ...

    async def image(self, *, aovs: bool = False,
                    max_side: int = 0) -> NDArray[numpy.float32] | dict[str, NDArray[numpy.float32]]:
        """As Job.image."""
        if aovs:
            return await _of_job(self._job, lambda job: job.image(aovs=True))
        return await _of_job(self._job, lambda job: job.image(max_side=max_side))


class AsyncSequence:
    """As Sequence, with the same verbs."""

    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self.id = sequence.id
        self.warnings = sequence.warnings

    def __repr__(self) -> str:
        return f"AsyncSequence({self.id!r})"

    status = _sequence_verb(Sequence.status)
    wait = _sequence_verb(Sequence.wait)
    save = _sequence_verb(Sequence.save)
    pause = _sequence_verb(Sequence.pause)
    resume = _sequence_verb(Sequence.resume)
    cancel = _sequence_verb(Sequence.cancel)
    retry = _sequence_verb(Sequence.retry)
    extend = _sequence_verb(Sequence.extend)
    set_priority = _sequence_verb(Sequence.set_priority)

    def frame(self, number: int) -> AsyncJob:
        """As Sequence.frame."""
        return AsyncJob(self._sequence.frame(number))

    async def frames(self, *, since: int = 0) -> AsyncIterator[FrameStatus]:
        """As Sequence.frames."""
        async for frame in _items(lambda transport: self._sequence._scoped(transport).frames(since=since),
                                  self._sequence._transport):
            yield frame

    async def watch(self) -> AsyncIterator[SequenceStatus]:
        """As Sequence.watch."""
        async for status in _items(lambda transport: self._sequence._scoped(transport).watch(),
                                   self._sequence._transport):
            yield status


class AsyncFarm:
    """As Farm, with the same arguments and verbs."""

    @functools.wraps(Farm.__init__)
    def __init__(self, *args: Any, **options: Any) -> None:
        self._farm = Farm(*args, **options)

    def __repr__(self) -> str:
        return f"Async{self._farm!r}"

    def close(self) -> None:
        """As Farm.close."""
        self._farm.close()

    def give_up(self) -> None:
        """As Farm.give_up. A call of its own ends when its task is cancelled."""
        self._farm.give_up()

    async def __aenter__(self) -> AsyncFarm:
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def job(self, job_id: str) -> AsyncJob:
        """As Farm.job."""
        return AsyncJob(self._farm.job(job_id))

    check = _farm_verb(Farm.check)
    submit = _submitting(Farm._submit_job)

    async def submit_frames(self, scene: Path, frames: str | Iterable[int], **options: Any) -> AsyncSequence:
        """As Farm.submit with `frames`."""
        made = await _of_farm(self._farm, lambda farm: farm.submit(scene, frames=frames, **options))
        return AsyncSequence(made._scoped(self._farm._transport))

    async def submit_checked(self, frames: Iterable[tuple[int, SceneCheck]], **options: Any) -> AsyncSequence:
        """As Farm.submit_checked."""
        made = await _of_farm(self._farm, lambda farm: farm.submit_checked(frames, **options))
        return AsyncSequence(made._scoped(self._farm._transport))

    def sequence(self, sequence_id: str) -> AsyncSequence:
        """As Farm.sequence."""
        return AsyncSequence(self._farm.sequence(sequence_id))

    submit_bundle = _submitting(Farm.submit_bundle)

    async def jobs(self, *, frames: bool = False) -> AsyncIterator[JobStatus]:
        """As Farm.jobs."""
        async for status in _items(lambda transport: self._farm._scoped(transport).jobs(frames=frames),
                                   self._farm._transport):
            yield status

    async def sequences(self) -> AsyncIterator[SequenceStatus]:
        """As Farm.sequences."""
        async for status in _items(lambda transport: self._farm._scoped(transport).sequences(), self._farm._transport):
            yield status

    async def workers(self) -> AsyncIterator[WorkerStatus]:
        """As Farm.workers."""
        async for status in _items(lambda transport: self._farm._scoped(transport).workers(), self._farm._transport):
            yield status
