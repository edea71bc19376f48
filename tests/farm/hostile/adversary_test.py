"""Whoever can reach a coordinator does its worst, in a random order, while honest jobs are rendered:
adversary_test.py --bin build/release/bin [--seconds 40] [--seed 1] [--marks]

Peers that take or send nothing, messages that never end, workers that hold, fail and lie, floods, and text that is
none. Afterwards honest jobs must have their bits, nothing may be lost, and the coordinator's memory must be within its
bound. With --marks the times of honest calls count, too; a test does not go by them.
"""
import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))  # what tests/farm shares
from farm import Farm, assert_same_pixels, wait_until  # noqa: E402
from paths import ROOM  # noqa: E402
from raw_peers import Crowd, http2_call  # noqa: E402
from wire import PB, load_proto  # noqa: E402
import grpc  # noqa: E402

MEMORY_MB = 300  # above the quiet state
PEERS, HOLDERS, STUBS = 200, 40, 8
CALL_S = 5
TEXTS = [b"caf\xe9", b"\x1b[2Jcleared", "\u202egnp.exe".encode(), b"\0\0", b"x" * 60000, b"<script>alert(1)</script>", b"\xff" * 900]


def varint(number):
    out = b""
    while number > 127:
        out, number = out + bytes([number & 127 | 128]), number >> 7
    return out + bytes([number])


def field(number, data):
    """A field of bytes, as any message may have it."""
    return varint(number << 3 | 2) + varint(len(data)) + data


class Adversary(threading.Thread):
    """Plays until told to stop. All that it does is drawn from its seed."""

    def __init__(self, farm, http, seed, victim):
        super().__init__(daemon=True)
        self.farm, self.http, self.victim = farm, http, victim
        self.rpc = int(farm.address.split(":")[1])
        self.random = random.Random(seed)
        self.ended = threading.Event()
        self.crowd = Crowd(PEERS)
        options = [("grpc.use_local_subchannel_pool", 1), ("grpc.max_send_message_length", 1 << 30)]
        self.channels = [grpc.insecure_channel(farm.address, options) for _ in range(STUBS)]
        self.holders, self.held, self.played, self.fault = [], [], {}, None
        build = farm.run_coordinator("--version").strip()
        self.registration = dict(threads=4, build=build, schema=int(build.split(" schema ")[1].split(",")[0]),
                                 arithmetic_class=farm.json("workers")[0]["arithmetic_class"])

    def client(self):
        return PB["client_pb2_grpc"].ClientServiceStub(self.random.choice(self.channels))

    def worker(self):
        return PB["worker_pb2_grpc"].WorkerServiceStub(self.random.choice(self.channels))

    def raw(self, path, body):
        service = "ClientService/" if path in ("SubmitJob", "GetJob", "FindMissingBlobs") else "WorkerService/"
        same = {"request_serializer": None, "response_deserializer": None}
        return self.random.choice(self.channels).unary_unary(f"/lightmill.v1.{service}{path}", **same)(body, timeout=CALL_S)

    # --- what it plays ---
    def slow_peer(self):
        job = field(1, self.victim.encode())
        begin = field(1, field(1, f"{self.random.getrandbits(256):064x}".encode()) + b"\x10\x80\x80\x04")
        path, body, end = self.random.choice([
            ("ClientService/FetchImage", job, True), ("ClientService/WatchJob", job, True),
            ("ClientService/ListTiles", job, True), ("ClientService/UploadBlobs", begin, False)])
        self.crowd.add(self.rpc, http2_call(path, body, window=self.random.choice((0, 1, 4000)), end=end,
                                            streams=self.random.choice((1, 3, 20))), self.random.random() < 0.5)

    def half_message(self):
        size = self.random.choice((5000, 1 << 20, 4 << 20, 15 << 20, 1 << 31))
        method = self.random.choice(("ClientService/SubmitJob", "ClientService/FindMissingBlobs", "WorkerService/Renew",
                                     "WorkerService/Commit", "ClientService/GetJob"))
        body = b"x" * self.random.randrange(60000)
        self.crowd.add(self.rpc, http2_call(method, body, size=size, end=False, streams=self.random.choice((1, 5))), True)

    def http_peer(self):
        ranges = ",".join(f"{i}-" for i in range(1500))
        text = self.random.choice([
            "GET / HT", f"GET /api/v1/jobs/{self.victim}/image.exr HTTP/1.1\r\nHost: x\r\n\r\n",
            f"GET /api/v1/jobs/{self.victim}/image.exr HTTP/1.1\r\nHost: x\r\nRange: bytes={ranges}\r\n\r\n",
            "POST /api/v1/jobs/j1/cancel HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n",
            "PUT /api/v1/blobs/" + "0" * 64 + " HTTP/1.1\r\nHost: x\r\nContent-Length: 999999999999\r\n\r\n"])
        self.crowd.add(self.http, text.encode(), self.random.random() < 0.5)

    def join(self):
        text = self.random.choice(("evil", "\u202eevil", "e" * 999))
        registration = PB["types_pb2"].WorkerRegistration(host=text, **self.registration)
        answer = self.worker().Register(PB["worker_pb2"].RegisterRequest(registration=registration), timeout=CALL_S)
        self.holders = (self.holders + [answer.worker_id])[-HOLDERS:]

    def hold(self):
        name = self.random.choice(self.holders)
        answer = self.worker().Lease(PB["worker_pb2"].LeaseRequest(worker_id=name, wait_seconds=0.1), timeout=CALL_S)
        if answer.HasField("grant"):
            self.held.append((name, answer.grant.key))

    def renew(self):
        for name in set(name for name, _ in self.held):
            keys = [key for holder, key in self.held if holder == name]
            answer = self.worker().Renew(PB["worker_pb2"].RenewRequest(worker_id=name, held=keys), timeout=CALL_S)
            lost = {key.SerializeToString() for key in answer.lost}
            self.held = [(n, k) for n, k in self.held if n != name or k.SerializeToString() not in lost]

    def fail(self):
        name, key = self.held.pop(self.random.randrange(len(self.held)))
        self.worker().Fail(PB["worker_pb2"].FailRequest(
            worker_id=name, key=key, reason=self.random.choice(TEXTS), handed_back=self.random.random() < 0.3,
            kind=self.random.randrange(4)), timeout=CALL_S)

    def lie(self):
        name, key = self.random.choice(self.held)
        data = self.random.randbytes(self.random.choice((0, 10, 5000)))
        header = PB["worker_pb2"].CommitRequest.Header(worker_id=name, key=key, size=len(data), digest="0" * 64)
        parts = [PB["worker_pb2"].CommitRequest(header=header), PB["worker_pb2"].CommitRequest(chunk=data)]
        self.worker().Commit(iter(parts), timeout=CALL_S)

    def impersonate(self):
        name = self.random.choice(("w1", "w2", "w1.", "w1." + "0" * 32))
        key = PB["types_pb2"].LeaseKey(job_id=self.victim, tile_id=self.random.randrange(5), attempt=1)
        kind = self.random.randrange(3)
        if kind == 0:
            self.worker().Drain(PB["worker_pb2"].DrainRequest(worker_id=name), timeout=CALL_S)
        elif kind == 1:
            self.worker().Fail(PB["worker_pb2"].FailRequest(worker_id=name, key=key, reason=b"no"), timeout=CALL_S)
        else:
            self.worker().Lease(PB["worker_pb2"].LeaseRequest(worker_id=name), timeout=CALL_S)

    def flood(self):
        number = self.random.choice((10, 10000, 1000000))
        self.raw(*self.random.choice([
            ("Renew", field(1, b"w1") + field(2, b"") * number), ("FindMissingBlobs", field(1, b"") * number),
            ("GetJob", field(1, b"j1") + field(99, b"x" * min(number, 60000))),
            ("SubmitJob", field(2, b"[" * number)), ("SubmitJob", field(2, b'{"a":' * number + b"1")),
            ("SubmitJob", field(3, b"[" + b"{}," * number + b"{}]")), ("Fail", field(3, b"\xff" * number))]))

    def words(self):
        text = self.random.choice(TEXTS)
        number = self.random.randrange(1, 12)
        self.raw(self.random.choice(("SubmitJob", "GetJob", "Register", "Warn", "Fail", "GetBundle")), field(number, text))

    def run(self):
        plays = [self.slow_peer, self.half_message, self.http_peer, self.join, self.hold, self.hold, self.renew, self.fail,
                 self.lie, self.impersonate, self.flood, self.words]
        try:
            while not self.ended.is_set():
                play = self.random.choice(plays)
                if (play in (self.fail, self.lie) and not self.held) or (play == self.hold and not self.holders):
                    continue
                try:
                    play()
                except grpc.RpcError:
                    pass  # refused, as it should be
                self.played[play.__name__] = self.played.get(play.__name__, 0) + 1
                self.crowd.turn(self.random)
        except Exception as fault:  # of the test itself
            self.fault = fault
        self.crowd.close()


class HostileFarm(Farm):
    def run_coordinator(self, *arguments):
        done = subprocess.run([self.bin / "lightmill-coordinator", *arguments], capture_output=True, text=True, check=True)
        return done.stdout

    def megabytes(self, what):
        status = pathlib.Path(f"/proc/{self.coordinator.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith(what)).split()[1]) / 1024


def timed(times, verb, *arguments):
    """What a verb prints."""
    begin = time.monotonic()
    printed = verb(*arguments)
    times.append((time.monotonic() - begin, str(arguments[0])))
    return printed


def play(bin_dir, seconds, seed, marks):
    kinds = [("--integrator", "pt", "--spp", 16), ("--integrator", "auto", "--spp", 8), ("--integrator", "bdpt", "--spp", 8)]
    with HostileFarm(bin_dir) as farm:
        farm.start_coordinator()
        for _ in range(2):
            farm.start_worker(1)
        right = []
        for number, kind in enumerate(kinds):
            job = farm.submit(ROOM, *kind, "--resolution", "128x96")
            farm.lightmill("watch", job)
            right.append(farm.folder / f"right{number}.exr")
            farm.lightmill("fetch", job, "-o", right[-1])
        quiet = farm.megabytes("VmHWM")
        adversary = Adversary(farm, int(farm._ports(farm.folder / "port")["http"]), seed, job)
        adversary.start()
        times, rounds, end = [], 0, time.monotonic() + seconds
        while rounds < len(kinds) or time.monotonic() < end:
            number = rounds % len(kinds)
            job = timed(times, farm.submit, ROOM, *kinds[number], "--resolution", "128x96")
            farm.lightmill("watch", job)
            output = farm.folder / f"honest{rounds}.exr"
            timed(times, lambda *a: farm.lightmill(*a), "fetch", job, "-o", output)
            timed(times, lambda *a: farm.lightmill(*a), "job", job)
            assert_same_pixels(output, right[number])
            rounds += 1
        adversary.ended.set()
        adversary.join()
        assert not adversary.fault, repr(adversary.fault)
        grown = farm.megabytes("VmHWM") - quiet
        jobs = farm.json("jobs")
        bad = [j for j in jobs if j["state"] != "done"]
        assert not bad, f"{len(bad)} of {len(jobs)} jobs are not done: {json.dumps(bad[0])[:500]}"
        honest = [w for w in farm.json("workers") if w["id"] in ("w1", "w2")]
        assert [w["state"] for w in honest] == ["idle", "idle"], honest
        slowest = max(times)
        played = " ".join(f"{name} {count}" for name, count in sorted(adversary.played.items()))
        print(f"seed {seed}: {rounds} honest jobs; memory +{grown:.0f} MB above {quiet:.0f}; honest calls at most "
              f"{slowest[0]:.1f} s ({slowest[1]}); played: {played}")
        assert grown <= MEMORY_MB, f"{grown:.0f} MB more than in the quiet state"
        assert not marks or slowest[0] <= 2, f"{slowest[1]} took {slowest[0]:.1f} s"
        farm.coordinator.terminate()
        assert farm.coordinator.wait(timeout=120) == 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--seconds", type=float, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--marks", action="store_true", help="honest calls must take 2 s at most")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightmill-stubs-") as stubs:
        load_proto(stubs)
        play(arguments.bin, arguments.seconds, arguments.seed, arguments.marks)


if __name__ == "__main__":
    main()
