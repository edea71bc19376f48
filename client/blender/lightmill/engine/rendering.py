"""One job, from the exported scene to its last picture, in a thread of its own, so that Blender never waits for a farm.

    rendering = Rendering(connection, main, options)   # starts at once
    while not rendering.ended:
        rendering.note, rendering.status, rendering.take_picture()
    rendering.cancel()                                  # at any time
"""
import sys
import threading
import time
import traceback

from . import local_farm
from .connection import ERRORS
from .farm_api import api

FIRST_POLL_SECONDS, LAST_POLL_SECONDS, POLL_GROWTH = 0.02, 0.5, 1.1
RETRY_SECONDS = 1.0
PICTURE_SHARE = 4.0          # pictures that grow take at most one part in so many of the time
LEAST_PICTURE_SECONDS = 0.3  # between two of them
CANCEL_SECONDS = 10.0        # for telling the farm, in the background


class Rendering:
    """`options`: those of api.Farm.submit; what they name as `aovs` the last picture has, those before it do not. `growing`:
    pictures before the last one are wanted. `job_id`: of a job that was submitted already."""

    def __init__(self, connection, main, options, *, growing=True, job_id=None):
        self.note = "starting"  # what happens, for the status line
        self.status = None      # api.JobStatus, the newest
        self.error = ""         # one line; empty: none so far
        self.ended = False
        self.job_id = job_id    # of a job that was submitted before; else once it is
        self.warnings = ()      # of the scene, from the coordinator
        self.growing = growing
        self._connection, self._main, self._options = connection, main, options
        self._picture = None
        self._lock = threading.Lock()
        self._cancelled = threading.Event()
        self._farm = None
        self._thread = threading.Thread(target=self._run, name="lightmill-render", daemon=True)
        self._thread.start()

    def take_picture(self):
        """The newest api.Picture that was not taken yet, or None."""
        with self._lock:
            picture, self._picture = self._picture, None
        return picture

    def cancel(self):
        """Gives it up: the job is cancelled in the background. It does not wait."""
        self._cancelled.set()
        farm = self._farm
        if farm is not None and self.job_id is not None:  # else the job may be made just now: it is cancelled then
            farm.give_up()

    def wait(self, seconds):
        """Until it has ended, or so long."""
        self._thread.join(seconds)

    def _run(self):
        try:
            self._render()
        except ERRORS as error:
            self.error = self.error or _one_line(error)
        except Exception as error:  # a mistake of ours must not leave Blender waiting
            traceback.print_exc(file=sys.stderr)
            self.error = f"the add-on failed: {_one_line(error)}"
        if self._cancelled.is_set():
            self.error = ""
            self._cancel_job()
        self.ended = True

    def _render(self):
        if self._connection.local:
            self.note = "starting this machine's renderer"
        self._farm = self._connection.open()
        if self._cancelled.is_set():
            return
        if self.job_id is None:
            self.note = "sending the scene"
            job = self._farm.submit(self._main, progress=self._sent, **self._options)
            self.job_id, self.warnings = job.id, job.warnings
        else:
            job = self._farm.job(self.job_id)
        self._follow(job)

    def _sent(self, done, total):
        if self._cancelled.is_set():
            raise api.Unreachable("the scene is not sent any more")
        self.note = f"sending the scene, {done / 1e6:.1f} of {total / 1e6:.1f} MB"

    def _follow(self, job):
        pause, lost_since, shown, next_picture = FIRST_POLL_SECONDS, None, 0.0, 0.0
        while not self._cancelled.is_set():
            try:
                status = job.status()
                self.status, self.note = status, status.message
                if status.state.final:
                    if status.state is not api.JobState.DONE:
                        raise api.JobFailed(status)
                    self._give(job.picture(aovs="aovs" in self._options))
                    return
                now = time.monotonic()
                if self.growing and status.spp > shown and now >= next_picture:
                    self._give(job.picture(for_display=True))
                    shown, spent = status.spp, time.monotonic() - now
                    next_picture = time.monotonic() + max(LEAST_PICTURE_SECONDS, PICTURE_SHARE * spent)
                lost_since = None
            except api.Unreachable as error:
                if self._cancelled.is_set():
                    return
                if self._connection.local:
                    local_farm.check()  # why it has ended says more
                lost_since = lost_since or time.monotonic()
                if time.monotonic() - lost_since > self._connection.reconnect_seconds:
                    raise
                self.note = f"waiting for the coordinator: {_one_line(error)}"
                self._cancelled.wait(RETRY_SECONDS)
            self._cancelled.wait(pause)
            pause = min(LAST_POLL_SECONDS, pause * POLL_GROWTH)

    def _give(self, picture):
        with self._lock:
            self._picture = picture

    def _cancel_job(self):
        """Of a job that was submitted. Whoever is gone meanwhile needs no telling."""
        if self.job_id is None:
            return
        try:
            farm = self._connection.open()
            timer = threading.Timer(CANCEL_SECONDS, farm.give_up)
            timer.daemon = True
            timer.start()
            farm.job(self.job_id).cancel()
            timer.cancel()
        except ERRORS:
            pass


def _one_line(error):
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
