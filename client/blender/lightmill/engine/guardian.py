"""Runs a farm for one Blender on its machine, and ends it when Blender ends, however it does.

    guardian.py COORDINATOR WORKER THREADS

Blender starts this as a process of its own and keeps the other end of its standard input: the input's end says that
Blender is gone. Each line of the output is JSON: {"http": PORT} once the farm is ready, {"error": "..."} as the last one.
The farm's data is a temporary folder, which goes with it. It runs without Blender's modules.
"""
import ctypes
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

START_SECONDS = 120.0  # on a very busy machine
MOST_CRASHES = 5      # of the worker
CRASH_SECONDS = 30.0  # a worker that lived for so long may crash again
STARTS = 2
LEASE_SECONDS = 5     # a crashed worker's tile is given to the next one after this
TILE_SECONDS = 0.3    # pictures grow as tiles are done


def _end_with_parent():
    """In a child, on Linux: it is killed when this process is, which may have no time for it."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def _start(command, log):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("LIGHTMILL_")}
    with open(log, "wb") as out:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, env=environment,
                                preexec_fn=_end_with_parent if sys.platform == "linux" else None)


def _last_line(log):
    lines = log.read_text("utf-8", "replace").strip().splitlines()
    return lines[-1][:500] if lines else "without a word"


def _say(**fields):
    try:
        print(json.dumps(fields), flush=True)
    except OSError:
        pass  # Blender is gone; the end of the input says so


class Guardian:
    def __init__(self, coordinator, worker, threads):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-farm-"))
        self.programs, self.threads = (coordinator, worker), threads
        self.children = {}
        self.ending = threading.Event()

    def run(self):
        try:
            threading.Thread(target=self._wait_for_the_end, daemon=True).start()
            # Both start at once, so the worker must know the port first. Somebody else may take it before the coordinator.
            for attempt in range(STARTS):
                port = _free_port()
                self._start_worker(port)
                http, error = self._start_coordinator(port)
                if http or self.ending.is_set():
                    break
                self.children["worker"].kill()
            if http:
                _say(http=http)
                error = self._watch(port)
            if error:
                _say(error=error)
        except OSError as error:
            _say(error=str(error))
        finally:
            for child in self.children.values():
                if child.poll() is None:
                    child.kill()
                child.wait()
            shutil.rmtree(self.folder, ignore_errors=True)

    def _wait_for_the_end(self):
        while sys.stdin.buffer.read(1):
            pass
        self.ending.set()

    def _start_coordinator(self, port):
        """Its HTTP port, or 0 and why there is none."""
        ports, log = self.folder / "ports", self.folder / "coordinator.log"
        self.children["coordinator"] = coordinator = _start(
            [self.programs[0], "--listen", f"127.0.0.1:{port}", "--http", "127.0.0.1:0", "--data", self.folder / "data",
             "--port-file", ports, "--lease-seconds", str(LEASE_SECONDS), "--tile-seconds", str(TILE_SECONDS),
             "--submit-rate", "1000000"], log)
        end = time.monotonic() + START_SECONDS
        while time.monotonic() < end and not self.ending.is_set():
            if coordinator.poll() is not None:
                return 0, f"{self.programs[0]} ended: {_last_line(log)}"
            said = dict(line.split("=", 1) for line in ports.read_text().split() if "=" in line) if ports.exists() else {}
            if "rpc" in said and "http" in said:
                return int(said["http"]), ""
            time.sleep(0.005)
        return 0, f"{self.programs[0]} does not answer: {_last_line(log)}"

    def _start_worker(self, port):
        self.children["worker"] = _start(
            [self.programs[1], "--coordinator", f"127.0.0.1:{port}", "--threads", self.threads, "--one-machine",
             "--cache-dir", self.folder / "cache"], self.folder / "worker.log")

    def _watch(self, port):
        """Until Blender is gone, or a program is. Returns which one ended and why."""
        crashes, started = 0, time.monotonic()
        while not self.ending.wait(0.05):
            if self.children["coordinator"].poll() is not None:
                return f"{self.programs[0]} ended: {_last_line(self.folder / 'coordinator.log')}"
            if self.children["worker"].poll() is None:
                continue
            crashes = 1 if time.monotonic() - started > CRASH_SECONDS else crashes + 1
            if crashes >= MOST_CRASHES:
                return f"{self.programs[1]} ended {crashes} times: {_last_line(self.folder / 'worker.log')}"
            started = time.monotonic()
            self._start_worker(port)
        return ""


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


if __name__ == "__main__":
    Guardian(*sys.argv[1:4]).run()
    os._exit(0)  # the thread may still read
