"""This machine's own farm, a coordinator and a worker: started when it is first needed, and kept while Blender runs.

So the engine has one way to render: the HTTP API. guardian.py sees to it that nothing is left behind.
"""
import json
import pathlib
import subprocess
import threading

from . import programs

START_SECONDS = 130.0  # a little more than the guardian waits

_lock = threading.Lock()
_farm = None


class LocalFarmError(Exception):
    """One line: this machine's farm can't start, or has ended."""


class LocalFarm:
    """`url` is its HTTP address."""

    def __init__(self, paths, threads):
        self.key = (tuple(paths), threads)
        self._failure = ""
        self._ready, self._said = threading.Event(), None
        guardian = pathlib.Path(__file__).resolve().with_name("guardian.py")
        try:
            self._process = subprocess.Popen(
                [programs.python(), "-I", "-S", str(guardian), *paths, str(threads)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl+C in Blender's terminal is Blender's
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0))  # of Windows
        except OSError as error:
            raise LocalFarmError(f"the farm of this machine can't start: {error}") from error
        threading.Thread(target=self._listen, name="lightmill-local", daemon=True).start()
        if not self._ready.wait(START_SECONDS):
            self.stop()
            raise LocalFarmError("the farm of this machine does not start; is the machine very busy?")
        if self._said is None:
            self.stop()
            raise LocalFarmError(self.failure())
        self.url = f"http://127.0.0.1:{self._said}"

    def _listen(self):
        for line in self._process.stdout:
            try:
                said = json.loads(line)
            except ValueError:
                continue
            if "error" in said:
                self._failure = str(said["error"])
            elif "http" in said:
                self._said = int(said["http"])
                self._ready.set()
        self._failure = self._failure or "the farm of this machine has ended"
        self._ready.set()

    def failure(self):
        """Why it has ended; empty while it runs."""
        return self._failure

    def stop(self):
        """Ends its processes; a second call does nothing."""
        self._process.stdin.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def running(paths, threads):
    """The farm of these programs with so many render threads (0: all processors). Raises LocalFarmError, MissingProgram."""
    global _farm
    with _lock:
        if _farm is not None and (_farm.key != (tuple(paths), threads) or _farm.failure()):
            _farm.stop()
            _farm = None
        if _farm is None:
            _farm = LocalFarm(paths, threads)
        return _farm


def check():
    """Raises LocalFarmError if the farm that was started has ended by itself."""
    farm = _farm
    if farm is not None and farm.failure():
        raise LocalFarmError(farm.failure())


def stop():
    global _farm
    with _lock:
        if _farm is not None:
            _farm.stop()
            _farm = None
