"""A farm of real processes on loopback, for tests. Free ports, a temporary folder, everything ended by pid."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

try:
    import numpy
    import OpenImageIO
except ImportError as error:
    print(f"skipped: {error}; install python3-numpy and python3-openimageio")
    sys.exit(77)

GENEROUS_S = 300  # for what must happen; only a hang takes so long


def wait_until(what, condition, pause=0.05):
    """Polls until condition() is true and returns its value; a hang is a failure, not a hang."""
    end = time.monotonic() + GENEROUS_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(pause)
    raise AssertionError(f"still waiting for: {what}")


def pixels(path):
    """Float pixels of an image, after asserting that all are finite and not all zero."""
    buffer = OpenImageIO.ImageBuf(str(path))
    array = numpy.asarray(buffer.get_pixels(OpenImageIO.FLOAT), numpy.float32)
    assert array.size > 1, f"{path} can't be read: {buffer.geterror()}"
    assert numpy.isfinite(array).all(), f"{path} has pixels that are not finite"
    assert array.any(), f"{path} is black"
    return array


def assert_same_pixels(a, b):
    x, y = pixels(a), pixels(b)
    assert x.shape == y.shape, f"{a} is {x.shape} and {b} {y.shape}"
    assert x.tobytes() == y.tobytes(), f"{a} and {b}: {(x != y).any(-1).sum()} pixels differ"


class Farm:
    """A coordinator, its workers and the client's verbs."""

    def __init__(self, bin_dir):
        self.bin = pathlib.Path(bin_dir)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-farm-"))
        self.address = None
        self.http = None  # HOST:PORT
        self.coordinator = None
        self.workers = []
        self.logs = []
        self.environment = {}  # of all that is started
        self.coordinator_options = []

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        for process in [*self.workers, self.coordinator]:
            if process and process.poll() is None:
                process.kill()
                process.wait()
        if kind:
            for log in self.logs:
                print(f"--- {log.name}\n{log.read_text(errors='replace')[-3000:]}")
        shutil.rmtree(self.folder, ignore_errors=True)

    def _start(self, name, arguments, environment=None):
        log = self.folder / f"{name}.log"
        if log not in self.logs:
            self.logs.append(log)
        with open(log, "ab") as out:
            return subprocess.Popen([self.bin / arguments[0], *map(str, arguments[1:])], stdout=out, stderr=out,
                                    env={**os.environ, **self.environment, **(environment or {})})

    def start_coordinator(self):
        """The first time on free ports; after a kill on the same ones, with the same data."""
        port_file = self.folder / "port"
        port_file.unlink(missing_ok=True)
        self.coordinator = self._start("coordinator", [
            "lightmill-coordinator", "--listen", self.address or "127.0.0.1:0", "--http", self.http or "127.0.0.1:0",
            "--data", self.folder / "data", "--port-file", port_file, *self.coordinator_options])
        text = wait_until("the coordinator's ports", lambda: self._ports(port_file))
        self.address = f"127.0.0.1:{text['rpc']}"
        self.http = f"127.0.0.1:{text['http']}"

    def _ports(self, port_file):
        assert self.coordinator.poll() is None, "the coordinator ended"
        if not port_file.exists():
            return None
        ports = dict(line.split("=") for line in port_file.read_text().split())
        return ports if "rpc" in ports and "http" in ports else None

    def kill_coordinator(self):
        self.coordinator.kill()
        self.coordinator.wait()

    def start_worker(self, threads, **environment):
        number = len(self.workers)
        worker = self._start(f"worker{number}", [
            "lightmill-worker", "--coordinator", self.address, "--threads", threads,
            "--cache-dir", self.folder / f"cache{number}"], environment)
        self.workers.append(worker)
        return worker

    def start_watch(self, job):
        return self._start("watch", ["lightmill", "watch", job, "--coordinator", self.address])

    def lightmill(self, *arguments, expect=0, connect=True):
        """Runs a verb and returns its stdout."""
        command = [self.bin / "lightmill", *map(str, arguments)]
        if connect:
            command += ["--coordinator", self.address]
        done = subprocess.run(command, capture_output=True, text=True, timeout=GENEROUS_S)
        assert done.returncode == expect, f"{command}: exit {done.returncode}, want {expect}: {done.stderr[-500:]}"
        return done.stdout

    def json(self, *arguments):
        return json.loads(self.lightmill(*arguments, "--json"))

    def submit(self, *arguments):
        job = self.lightmill("submit", *arguments).strip()
        assert job and "\n" not in job, f"submit must print the job's id alone, not {job!r}"
        return job

    def render(self, output, *arguments):
        path = self.folder / output
        self.lightmill("render", *arguments, "--quiet", "-o", path, connect=False)
        return path

    def finish_and_fetch(self, job, output):
        self.lightmill("watch", job)
        status = self.json("job", job)
        assert status["state"] == "done", status
        assert status["packets_done"] == status["packets_total"] > 0, status
        assert status["nonfinite"] == 0, status
        path = self.folder / output
        self.lightmill("fetch", job, "-o", path)
        return path

    def wait_for_packets(self, job, count):
        """Until so many packets are merged; the job must still be running then."""
        status = wait_until(f"{count} packets of {job}",
                            lambda: (s := self.json("job", job))["packets_done"] >= count and s)
        assert status["packets_done"] < status["packets_total"], f"{job} was done too early for this test: {status}"
        return status

    def kill_while_leased(self, job, victim, threads):
        """SIGKILLs the worker with so many threads at a moment when it provably holds a lease of the job.

        It is stopped first: a stopped worker can't commit, so a lease that the ledger then shows is in its hands.
        """
        def holds_lease():
            victim.send_signal(signal.SIGSTOP)
            ids = {w["id"] for w in self.json("workers") if w["threads"] == threads}
            time.sleep(0.3)  # what it sent before it was stopped is handled by now
            held = [t for t in self.json("tiles", job) if t["state"] == "leased" and t["worker"] in ids]
            if held:
                return held
            victim.send_signal(signal.SIGCONT)
            return None

        held = wait_until("the victim's lease", holds_lease)
        victim.kill()
        victim.wait()
        return held
