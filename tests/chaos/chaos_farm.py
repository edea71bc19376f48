"""A farm that is being hurt: coordinator on a disk that fails, workers behind lines that fail, and what to do of it."""
import collections
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "farm"))
from disk_control import Disk  # noqa: E402
from farm import Farm  # noqa: E402
from wire_client import PATIENCE_S, Wire  # noqa: E402

LEASE_S = 1.0
ACKNOWLEDGED = re.compile(r"(j\d+) tile (\d+) attempt (\d+): (?:accepted|already committed)")


class ChaosFarm(Farm):
    def __init__(self, bin_dir, library, network, workers, seed, keep=None):
        super().__init__(bin_dir)
        self.library = library
        self.seed, self.keep = seed, keep
        self.network = network
        self.disk = Disk(self.folder / "disk-control")
        self.coordinator_due = None  # when to start it again; None: nobody means it to be down
        self.worker_due = [None] * workers
        self.expected_dead = set()  # pids that were killed or asked to go
        self.notes = collections.Counter()
        self.struck = collections.Counter()  # system calls that a cut came before
        self.start_coordinator()
        self.wire = Wire(self.address)
        port = int(self.address.rsplit(":", 1)[1])
        self.links = [network.add(port, seed * 100 + i) for i in range(workers)]
        self.workers = [None] * workers
        for number in range(workers):
            self.start_chaos_worker(number)

    def __exit__(self, *exception):
        if exception[0] and self.keep:
            shutil.copytree(self.folder, self.keep / f"run-{self.seed}", dirs_exist_ok=True)
        super().__exit__(*exception)
        self.wire.close()
        for link in self.links:
            self.network.remove(link)

    # --- processes ---
    def start_coordinator(self):
        port_file = self.folder / "port"
        port_file.unlink(missing_ok=True)
        self.coordinator = self._start("coordinator", [
            "lightmill-coordinator", "--listen", self.address or "127.0.0.1:0", "--http", "127.0.0.1:0",
            "--data", self.folder / "data", "--port-file", port_file, "--lease-seconds", LEASE_S,
            "--tile-seconds", 0.02, "--checkpoint-mb", 1],
            self.disk.environment(self.folder / "data", self.library))
        self.coordinator_due = None
        end = time.monotonic() + PATIENCE_S
        while self.coordinator.poll() is None and time.monotonic() < end:
            if ports := self._ports_if_there(port_file):
                self.address = f"127.0.0.1:{ports['rpc']}"
                return True
            time.sleep(0.02)
        if self.coordinator.returncode == 1:  # its disk: it says so and goes, and whoever watches it tries again
            self.notes["starts refused"] += 1
        else:
            self.check_exit("coordinator", self.coordinator, {-signal.SIGKILL})
        self.coordinator_due = time.monotonic() + 0.2
        return False

    @staticmethod
    def _ports_if_there(port_file):
        if not port_file.exists():
            return None
        ports = dict(line.split("=") for line in port_file.read_text().split())
        return ports if "rpc" in ports else None

    def start_chaos_worker(self, number):
        self.workers[number] = self._start(f"worker{number}", [
            "lightmill-worker", "--coordinator", f"127.0.0.1:{self.links[number].port}", "--threads", 1 + number % 2,
            "--cache-dir", self.folder / f"cache{number}", "--drain-timeout", 3, "--log-level", "debug"],
            {"LIGHTMILL_TEST_ARITHMETIC_CLASS": "chaos"})  # finding it out takes longer than a run's tiles
        self.worker_due[number] = None

    def check_exit(self, name, process, allowed):
        if process.returncode not in allowed:
            log = next(l for l in self.logs if l.stem == name).read_text(errors="replace")
            raise AssertionError(f"{name} ended with {process.returncode}: {log[-2000:]}")

    def supervise(self):
        """Starts again what has ended, at its time."""
        now = time.monotonic()
        if self.coordinator.poll() is not None:
            if self.coordinator_due is None:  # by itself: a cut
                self.check_exit("coordinator", self.coordinator, {-signal.SIGKILL})
                self.notes["cuts"] += 1
                self.struck[self.disk.struck()] += 1
                self.disk.heal()
                self.coordinator_due = now + 0.3
            elif now >= self.coordinator_due:
                self.start_coordinator()
        for number, worker in enumerate(self.workers):
            if worker.poll() is None:
                continue
            if self.worker_due[number] is None:  # 3: refused, as far as it could make out over its line
                self.check_exit(f"worker{number}", worker, {0, 3} if worker.pid in self.expected_dead else {3})
                self.notes["workers refused"] += 1
                self.worker_due[number] = now + 0.2
            elif now >= self.worker_due[number]:
                self.start_chaos_worker(number)

    # --- afterwards ---
    def acknowledged(self):
        """How often each (tile, attempt) was answered as merged, over the logs of all workers."""
        seen = collections.Counter()
        for number in range(len(self.workers)):
            text = (self.folder / f"worker{number}.log").read_text(errors="replace")
            seen.update((job, int(tile), int(attempt)) for job, tile, attempt in ACKNOWLEDGED.findall(text))
        return seen

    def end_coordinator(self):
        self.coordinator.send_signal(signal.SIGTERM)
        assert self.coordinator.wait(PATIENCE_S) == 0, "SIGTERM must end the coordinator with 0"

    def check_data(self):
        done = subprocess.run([self.bin / "lightmill-coordinator", "--data", self.folder / "data", "--check"],
                              capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 0, f"--check: {done.stdout}{done.stderr}"
