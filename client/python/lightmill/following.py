"""Streams of states, from the first to the last one: what jobs and sequences have in common."""
from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Protocol, TypeVar

from .errors import LightmillError, ServerError, Unreachable, WaitTimeout, error_of
from .model import JobState
from .transport import Transport

SILENCE_SECONDS = 15.0  # a status comes every five seconds at the latest
RETRY_SECONDS = 1.0
_LOST_CODES = (1, 2, 4, 13, 14)  # a stream that ends with these goes on elsewhere


class Status(Protocol):
    """What has a state."""
    @property
    def state(self) -> JobState: ...


S = TypeVar("S", bound=Status)


def states(transport: Transport, path: str, make: Callable[[Any], S], reconnect_seconds: float) -> Iterator[S]:
    """The status at once, after every change and now and then; the last one is final. `make` makes it of a message. When
    the coordinator is lost it goes on with the one that leads then. Raises Unreachable if none does for so long."""
    give_up: float | None = None
    while True:
        try:
            for status in _stream(transport, path, make):
                give_up = None
                yield status
                if status.state.final:
                    return
        except Unreachable:
            transport.scope.check()
            give_up = give_up or time.monotonic() + reconnect_seconds
            if time.monotonic() > give_up:
                raise
        transport.scope.ended.wait(RETRY_SECONDS)


def _stream(transport: Transport, path: str, make: Callable[[Any], S]) -> Iterator[S]:
    answer = transport.open("GET", path, timeout=SILENCE_SECONDS)
    try:
        while line := answer.line():
            yield make(message_of(line))
    finally:
        answer.close()


def last_state(what: str, watched: Iterable[S], timeout: float | None, failure: Callable[[S], LightmillError]) -> S:
    """The status in which all is done. Raises `failure` of one that has ended otherwise, WaitTimeout after `timeout`
    seconds. `what`: "job j7"."""
    end = None if timeout is None else time.monotonic() + timeout
    for status in watched:
        if status.state is JobState.DONE:
            return status
        if status.state.final:
            raise failure(status)
        if end is not None and time.monotonic() >= end:
            raise WaitTimeout(f"{what} is {status.state.value} after {timeout:g} s")
    raise ServerError(f"{what}: the stream of its states ended")


def message_of(line: bytes) -> Any:
    """The message of a line of a stream. Raises what the line says."""
    try:
        said = json.loads(line)
    except ValueError as error:  # cut off
        raise Unreachable("the connection was lost") from error
    if isinstance(said, dict) and isinstance(said.get("result"), dict):
        return said["result"]
    status = said.get("error") if isinstance(said, dict) else None
    if isinstance(status, dict) and status.get("code") in _LOST_CODES:
        raise Unreachable(str(status.get("message", "")) or "the stream ended")
    raise error_of(status)
