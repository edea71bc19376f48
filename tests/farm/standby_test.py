"""Two coordinators on one PostgreSQL: whatever dies in the middle of a job, the other one goes on, and the pixels are
those of `lightmill render`.

    standby_test.py --bin build/release/bin [takeover] [pause] [database] [refusals]
"""
import argparse
import json
import pathlib
import re
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from farm import Farm, assert_same_pixels, wait_until  # noqa: E402
from paths import ROOM  # noqa: E402
from postgres import Missing, PostgresServer  # noqa: E402

LONG_SPP = 1024  # enough for a coordinator to be killed in the middle of
LEASE_S = 3


def options(spp):
    return [ROOM, "--integrator", "bdpt", "--resolution", "80x48", "--seed", "7", "--spp", str(spp)]


class StandbyFarm(Farm):
    """Coordinators with one database and one folder; `address` names all of them."""

    def __init__(self, bin_dir):
        super().__init__(bin_dir)
        self.coordinators = {}  # name -> process
        self.addresses = {}
        self.database = PostgresServer()

    def __exit__(self, kind, *rest):
        for process in self.coordinators.values():
            process.kill()
            process.wait()
        if kind:
            print(f"--- PostgreSQL\n{self.database.log.read_text(errors='replace')[-2000:]}")
        self.database.close()
        super().__exit__(kind, *rest)

    def start(self, name, *more):
        """Comes back once it listens, as the leader or as a standby."""
        port_file = self.folder / f"port-{name}"
        port_file.unlink(missing_ok=True)
        self.coordinator = self.coordinators[name] = self._start(name, [
            "lightmill-coordinator", "--listen", self.addresses.get(name, "127.0.0.1:0"), "--http", "127.0.0.1:0",
            "--data", self.folder / "data", "--store", self.database.url(), "--leader-lease", LEASE_S,
            "--port-file", port_file, *more])
        ports = wait_until(f"the ports of {name}", lambda: self._ports(port_file))
        self.coordinator = None
        self.addresses[name] = f"127.0.0.1:{ports['rpc']}"
        self.address = ",".join(self.addresses.values())

    def log(self, name):
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def leads(self, name, times=1):
        return self.log(name).count("leading the farm") >= times

    def epoch(self):
        return int(self.database.sql("SELECT epoch FROM leader"))

    def say(self, name):
        """What the coordinator of this name answers to a client that knows no other."""
        return subprocess.run([self.bin / "lightmill", "jobs", "--coordinator", self.addresses[name]],
                              capture_output=True, text=True, timeout=60)


def begin(farm, reference_spp=LONG_SPP):
    """a leads, b stands by, two workers; the job is running. Returns the reference and the job."""
    reference = farm.render("local.exr", *options(reference_spp))
    farm.start("a")
    wait_until("a to lead", lambda: farm.leads("a"))
    farm.start("b")
    refused = farm.say("b")
    assert refused.returncode == 3, refused
    assert f"the coordinator at {farm.addresses['a']} leads this farm" in refused.stderr, refused.stderr
    farm.start_worker(1)
    farm.start_worker(1)
    job = farm.submit(*options(reference_spp))
    return reference, job


def test_takeover(bin_dir):
    """kill -9 of the leader; later the other one dies, too, and the first one, started again, takes over."""
    with StandbyFarm(bin_dir) as farm:
        reference, job = begin(farm)
        before = farm.wait_for_packets(job, 100)["packets_done"]
        watching = subprocess.Popen([farm.bin / "lightmill", "watch", job, "--quiet", "--coordinator", farm.address])
        killed = float(farm.database.sql("SELECT extract(epoch FROM clock_timestamp())"))
        farm.coordinators["a"].kill()
        wait_until("b to take over", lambda: farm.leads("b"))
        # The database's clock says when: it puts the lease's end to that moment and its length.
        taken = float(farm.database.sql("SELECT extract(epoch FROM max(backend_start)) FROM pg_stat_activity "
                                        "WHERE application_name = 'lightmill'"))
        print(f"taken over {taken - killed:.1f} s after kill -9, with a lease of {LEASE_S} s")
        assert taken - killed < 15
        status = farm.json("job", job)
        assert status["packets_done"] >= before, f"acknowledged packets are gone: {status}"
        wait_until("new packets", lambda: farm.json("job", job)["packets_done"] > status["packets_done"])

        farm.start("a")  # now the standby
        assert "standby" in farm.log("a")
        farm.coordinators["b"].kill()
        wait_until("a to take over", lambda: farm.leads("a", 2))
        assert farm.epoch() == 3
        assert_same_pixels(reference, farm.finish_and_fetch(job, "taken.exr"))
        assert watching.wait(timeout=300) == 0, "a client that watches goes to whoever leads"
        for worker in farm.workers:
            assert worker.poll() is None

        farm.coordinators["a"].terminate()  # a good end leaves the lease to others at once
        assert farm.coordinators["a"].wait(timeout=60) == 0
        assert farm.database.sql("SELECT held FROM leader") == "f"
        check = subprocess.run([farm.bin / "lightmill-coordinator", "--check", "--data", farm.folder / "data",
                                "--store", farm.database.url()], capture_output=True, text=True, timeout=120)
        assert check.returncode == 0 and "agree" in check.stdout, check


def test_pause(bin_dir):
    """A leader that is stopped past its lease and continued writes nothing any more, says so, and ends."""
    with StandbyFarm(bin_dir) as farm:
        reference, job = begin(farm)
        farm.wait_for_packets(job, 100)
        farm.coordinators["a"].send_signal(signal.SIGSTOP)
        wait_until("b to take over", lambda: farm.leads("b"))
        b_only = farm.addresses["b"]
        farm.address = b_only
        status = farm.json("job", job)
        farm.coordinators["a"].send_signal(signal.SIGCONT)
        assert farm.coordinators["a"].wait(timeout=120) == 1
        assert "another coordinator has taken over" in farm.log("a").splitlines()[-1], farm.log("a")[-500:]
        assert farm.epoch() == 2
        assert farm.json("job", job)["packets_done"] >= status["packets_done"]
        assert_same_pixels(reference, farm.finish_and_fetch(job, "woken.exr"))
        farm.coordinators["b"].terminate()
        assert farm.coordinators["b"].wait(timeout=60) == 0
        assert farm.database.sql("SELECT count(*) FROM tiles WHERE state <> 2") == "0"


def test_database(bin_dir):
    """The database crashes in the middle of a job: the job pauses with the reason, and goes on when it is back."""
    with StandbyFarm(bin_dir) as farm:
        reference, job = begin(farm)

        def in_state(state):
            """The job's status if it is that; a coordinator that loads everything anew does not answer for a moment."""
            asked = subprocess.run([farm.bin / "lightmill", "job", job, "--json", "--coordinator", farm.address],
                                   capture_output=True, text=True, timeout=60)
            status = json.loads(asked.stdout) if asked.returncode == 0 else {}
            return status.get("state") == state and status

        for packets in (60, 200):
            farm.wait_for_packets(job, packets)
            farm.database.kill()

            status = wait_until("the job to pause", lambda: in_state("paused"))
            assert "the job store failed" in status["message"] or "can't connect" in status["message"], status
            farm.database.start()
            wait_until("the job to go on", lambda: in_state("running"))
        assert_same_pixels(reference, farm.finish_and_fetch(job, "crashed.exr"))


def test_refusals(bin_dir):
    """A database that is down, a wrong one, a folder of another: one line, without a password."""
    with StandbyFarm(bin_dir) as farm:
        def start(store, data):
            return subprocess.run([farm.bin / "lightmill-coordinator", "--listen", "127.0.0.1:0", "--http", "",
                                   "--data", data, "--store", store], capture_output=True, text=True, timeout=60)

        down = start(f"postgresql://ann:geheim@/farm?host={farm.folder}", farm.folder / "d1")
        assert down.returncode == 1, down
        line = down.stderr.strip()
        assert "\n" not in line and "can't connect to the job store" in line and "geheim" not in line, line
        for url in ("mysql://x", "postgresql://ann:geheim%@x/farm"):
            wrong = start(url, farm.folder / "d2")
            assert wrong.returncode == 2 and "postgresql://USER@" in wrong.stderr, wrong
            assert "geheim" not in wrong.stderr, wrong
        farm.start("a")
        wait_until("a to lead", lambda: farm.leads("a"))
        assert not re.search(r"password|geheim", farm.log("a"))
        farm.coordinators["a"].terminate()
        farm.coordinators["a"].wait()
        other = start(farm.database.url(), farm.folder / "d3")
        assert other.returncode == 1 and "is it mounted" in other.stderr, other
        alone = subprocess.run([farm.bin / "lightmill-coordinator", "--listen", "127.0.0.1:0", "--http", "",
                                "--data", farm.folder / "data"], capture_output=True, text=True, timeout=60)
        assert alone.returncode == 1 and "--store" in alone.stderr, alone


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("parts", nargs="*")
    arguments = parser.parse_args()
    tests = {"takeover": test_takeover, "pause": test_pause, "database": test_database, "refusals": test_refusals}
    for part in arguments.parts or tests:
        begun = time.monotonic()
        try:
            tests[part](arguments.bin)
        except Missing as missing:
            print(f"skipped: {missing}")
            sys.exit(77)
        print(f"{part}: good, {time.monotonic() - begun:.0f} s")


main()
