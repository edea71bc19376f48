"""What can go wrong. Each error's text is one line for the user."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .model import JobStatus, SequenceStatus


class LightmillError(Exception):
    """Any error of this package."""


class InvalidArgument(LightmillError, ValueError):
    """Something in the request is out of range, or the scene can't be rendered."""


class NotFound(LightmillError, LookupError):
    """There is no such job or file."""


class AlreadyExists(LightmillError):
    """It is there already, or changed meanwhile."""


class FailedPrecondition(LightmillError):
    """The state does not allow it: a job that is paused is paused again, a file was not uploaded."""


class PermissionDenied(LightmillError, PermissionError):
    """The token's role may not do this."""


class Unauthenticated(PermissionDenied):
    """There is no token, or it is not known or too old."""


class ResourceExhausted(LightmillError):
    """A bound of the coordinator was met; the text names it. Trying again later may help."""


class ServerError(LightmillError):
    """The coordinator failed, for instance because its disk did."""


class Unreachable(LightmillError, ConnectionError):
    """No coordinator could be reached, or none of those that were leads the farm."""


class WaitTimeout(LightmillError, TimeoutError):
    """The job has not ended in the time that the caller would wait."""


class JobFailed(LightmillError):
    """The job failed or was cancelled. `status` is its last status."""

    def __init__(self, status: JobStatus) -> None:
        super().__init__(f"job {status.id} {status.state.value}" + (f": {status.message}" if status.message else ""))
        self.status = status


class SequenceFailed(LightmillError):
    """A frame failed or was cancelled. `status` is the sequence's last status."""

    def __init__(self, status: SequenceStatus) -> None:
        super().__init__(f"sequence {status.id} {status.state.value}" + (f": {status.message}" if status.message else ""))
        self.status = status


# By the number of a google.rpc.Code.
_BY_CODE: dict[int, type[LightmillError]] = {
    3: InvalidArgument, 4: Unreachable, 5: NotFound, 6: AlreadyExists, 7: PermissionDenied, 8: ResourceExhausted,
    9: FailedPrecondition, 10: AlreadyExists, 11: InvalidArgument, 14: Unreachable, 16: Unauthenticated,
}


def error_of(status: Any) -> LightmillError:
    """The error that a google.rpc.Status as JSON stands for."""
    if not isinstance(status, dict):
        return ServerError("the coordinator's answer is not understood")
    code, message = status.get("code"), str(status.get("message", ""))
    return _BY_CODE.get(code if isinstance(code, int) else 2, ServerError)(message or "the call failed")
