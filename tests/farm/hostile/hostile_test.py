"""Hostile clients, written from the proto files alone: nobody gets in without a token, nothing leads out of the
coordinator's folder, nothing makes it allocate, hang or stop.

    hostile_test.py --bin build/release/bin [strangers] [roles] [paths] [sizes] [partials] [quotas] [connections] [hung]
        [streams] [bombs] [workers]
"""
import argparse
import base64
import hashlib
import json
import os
import pathlib
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hostile_target import GENEROUS_S, PB, REFUSED, Target, code_of, methods, raw_call  # noqa: E402
from hostile_streams import check_streams  # noqa: E402
from paths import ROOM  # noqa: E402
from wire import load_proto  # noqa: E402
import grpc  # noqa: E402


def test_strangers(bin_dir):
    """Every RPC and every page without a token, with a wrong one, with a stolen hash; TLS without a certificate."""
    with Target(bin_dir) as target:
        hashes = [line.split()[3] for line in (target.credentials / "coordinator" / "tokens").read_text().splitlines()
                  if not line.startswith("#")]
        every = list(methods())
        assert len(every) > 20
        channel = target.channel("client")
        for path, streams_in, streams_out in every:
            for header in (None, "", "Bearer", "Bearer " + "0" * 74, "Bearer " + hashes[0], "Bearer " + "x" * 4000,
                           "Basic " + base64.b64encode(b"a:b").decode(), target.token("client")):
                metadata = None if header is None else [("authorization", header)]
                code = code_of(lambda: raw_call(channel, path, streams_in, streams_out, metadata=metadata))
                assert code == grpc.StatusCode.UNAUTHENTICATED, f"{path} with {header!r}: {code}"
        one_sided = target.channel("client", target.token("client"), certificate=False)
        path = "/lightmill.v1.ClientService/ListJobs"
        assert code_of(lambda: raw_call(one_sided, path, False, False)) == grpc.StatusCode.UNAVAILABLE
        plain = grpc.insecure_channel(f"localhost:{target.rpc}")
        target.channels.append(plain)
        assert code_of(lambda: raw_call(plain, path, False, False)) == grpc.StatusCode.UNAVAILABLE

        trust = ssl.create_default_context(cafile=str(target.credentials / "client" / "ca.crt"))

        def page(route, **headers):
            request = urllib.request.Request(f"https://localhost:{target.http}{route}", headers=headers)
            try:
                return urllib.request.urlopen(request, context=trust, timeout=GENEROUS_S).status
            except urllib.error.HTTPError as error:
                return error.code

        assert page("/healthz") == 200
        for route in ("/", "/metrics", "/../data/jobs.sqlite", "/healthz/../metrics", "/%2e%2e/", "/?x=/healthz"):
            for headers in ({}, {"Authorization": "Bearer " + hashes[0]}, {"Authorization": "Basic !!"}):
                assert page(route, **headers) == 401, route
        assert page("/metrics", Authorization="Bearer " + target.token("observer")) == 200
        assert page("/metrics", Authorization="Bearer " + target.token("worker")) == 403


def test_roles(bin_dir):
    """Each role reaches its own RPCs and no others; a revoked token is void at once."""
    with Target(bin_dir) as target:
        looking = {"GetJob", "ListJobs", "ListTiles", "ListWorkers", "WatchJob", "FetchImage", "GetCurve", "GetLogs",
                   "GetSequence", "ListSequences", "ListFrames", "WatchSequence"}
        for holder in ("worker", "client", "observer", "admin"):
            channel = target.channel(holder, target.token(holder))
            for path, streams_in, streams_out in methods():
                service, method = path.split("/")[1:]
                if service.endswith("WorkerService"):
                    allowed = holder == "worker"
                else:
                    allowed = holder in ("client", "admin") or holder == "observer" and method in looking
                code = code_of(lambda: raw_call(channel, path, streams_in, streams_out))
                assert (code == grpc.StatusCode.PERMISSION_DENIED) == (not allowed), f"{holder} {path}: {code}"
                assert code != grpc.StatusCode.UNAUTHENTICATED
            assert code_of(lambda: raw_call(channel, "/lightmill.v1.ClientService/Nothing", False, False)) in (
                grpc.StatusCode.PERMISSION_DENIED, grpc.StatusCode.UNIMPLEMENTED)
        client = target.client()
        assert code_of(lambda: client.ListJobs(PB["client_pb2"].ListJobsRequest())) == grpc.StatusCode.OK
        target.run("lightmill-coordinator", "revoke", "client", "--dir", target.credentials)
        assert code_of(lambda: client.ListJobs(PB["client_pb2"].ListJobsRequest())) == grpc.StatusCode.UNAUTHENTICATED
        said = target.cli("submit", ROOM, holder="observer", expect=3).stderr
        assert "has the role observer; this needs submitter or admin" in said and said.count("\n") == 1, said


def test_paths(bin_dir):
    """Names and digests that lead elsewhere."""
    with Target(bin_dir) as target:
        client, worker, pb = target.client(), target.worker(), PB["client_pb2"]
        _, settings, bundle, _ = target.job()
        good = bundle["entries"][0]
        evil = ["../x", "/etc/passwd", "a/../../b", "..", ".", "", "a//b", "./a", "a\\..\\b", "a\nb", "a\0b", "\x7f",
                "x" * 2000, "external/../../x"]
        for name in evil:
            changed = {**bundle, "main": name, "entries": [{**good, "name": name}]}
            request = pb.SubmitJobRequest(bundle_json=json.dumps(changed), settings_json=json.dumps(settings))
            assert code_of(lambda: client.SubmitJob(request)) == grpc.StatusCode.INVALID_ARGUMENT, repr(name)
        for digest in ["../../../etc/passwd", "/etc/passwd", "", "A" * 64, "a" * 63, "../" + "a" * 61, "a" * 63 + "\0"]:
            ask = pb.FindMissingBlobsRequest(digests=[digest])
            assert code_of(lambda: client.FindMissingBlobs(ask)) == grpc.StatusCode.INVALID_ARGUMENT, digest
            header = pb.UploadBlobsRequest(header=pb.UploadBlobsRequest.Header(digest=digest, size=1))
            assert code_of(lambda: client.UploadBlobs(iter([header]))) == grpc.StatusCode.INVALID_ARGUMENT, digest
            fetch = PB["worker_pb2"].FetchBlobsRequest(digests=[digest])
            assert code_of(lambda: worker.FetchBlobs(fetch)) in REFUSED, digest
            changed = {**bundle, "entries": [{**good, "digest": digest}]}
            request = pb.SubmitJobRequest(bundle_json=json.dumps(changed), settings_json=json.dumps(settings))
            assert code_of(lambda: client.SubmitJob(request)) == grpc.StatusCode.INVALID_ARGUMENT, digest
        for job in ["../j1", "j1/../j1", "", "x" * 2000, "j99", "j-1", "' OR 1=1 --"]:
            assert code_of(lambda: client.GetJob(pb.GetJobRequest(job_id=job))) == grpc.StatusCode.NOT_FOUND, job
        # Beyond the bound of the request (common/rpc/request_limits.cc).
        long = pb.GetJobRequest(job_id="x" * 100000)
        assert code_of(lambda: client.GetJob(long)) == grpc.StatusCode.RESOURCE_EXHAUSTED
        outside = [p for p in target.folder.rglob("*") if p.is_symlink() or p.name in ("x", "passwd", "b")]
        assert not outside, outside


def test_sizes(bin_dir):
    """Bombs of JSON, of messages, of announced sizes; images that nobody has the memory for."""
    with Target(bin_dir, "--max-pixels", 1 << 20, "--max-bundle-mb", 2) as target:
        client, pb = target.client(), PB["client_pb2"]
        _, settings, bundle, _ = target.job()
        bundle_json = json.dumps(bundle)

        def submit(settings_json, bundle_json=bundle_json, **more):
            request = pb.SubmitJobRequest(bundle_json=bundle_json, settings_json=settings_json, **more)
            return code_of(lambda: client.SubmitJob(request))

        assert submit(json.dumps(settings)) == grpc.StatusCode.OK, "the test's own submission must be fine"
        assert submit(json.dumps({**settings, "width": 1025, "height": 1024})) == grpc.StatusCode.RESOURCE_EXHAUSTED
        for key, values in {"width": [0, -1, 65537, 1 << 40, 1e300, "x", None], "height": [65537, 1.5],
                            "spp": [0, -1, 1 << 62, "1"], "max_depth": [-5, 1e99]}.items():
            for value in values:
                assert submit(json.dumps({**settings, key: value})) == grpc.StatusCode.INVALID_ARGUMENT, (key, value)
        for text in ["", "{}", "[" * 100000, '{"a":' * 100000, "null", "\xff", "1" * 1000000, "[" + "1," * 5000000 + "1]"]:
            assert submit(text) == grpc.StatusCode.INVALID_ARGUMENT, text[:20]
            assert submit(json.dumps(settings), text) == grpc.StatusCode.INVALID_ARGUMENT, text[:20]
        huge = {**bundle, "entries": [{**bundle["entries"][0], "size": 1 << 60}]}
        assert submit(json.dumps(settings), json.dumps(huge)) == grpc.StatusCode.RESOURCE_EXHAUSTED
        lying = {**bundle, "entries": [{**bundle["entries"][0], "size": 7}]}
        assert submit(json.dumps(settings), json.dumps(lying)) in REFUSED
        assert submit("x" * (17 << 20)) == grpc.StatusCode.RESOURCE_EXHAUSTED, "a message over 16 MiB"
        for size in (-1, 1 << 30):
            shape = pb.Reference(digest=bundle["entries"][0]["digest"], width=size, height=size)
            assert submit(json.dumps(settings), reference=shape) in REFUSED

        header = pb.UploadBlobsRequest.Header

        def upload(*messages):
            return code_of(lambda: client.UploadBlobs(iter(messages)))

        def begin(size, content=b""):
            return pb.UploadBlobsRequest(header=header(digest=hashlib.sha256(content).hexdigest(), size=size))

        assert upload(begin(1 << 60)) == grpc.StatusCode.RESOURCE_EXHAUSTED
        assert upload(begin(1500000), begin(1500000)) in REFUSED
        assert upload(begin(3, b"abc"), pb.UploadBlobsRequest(chunk=b"abcd")) == grpc.StatusCode.INVALID_ARGUMENT
        assert upload(begin(3, b"abc"), pb.UploadBlobsRequest(chunk=b"abd")) == grpc.StatusCode.INVALID_ARGUMENT
        assert upload(begin(3, b"abc"), pb.UploadBlobsRequest(chunk=b"ab")) == grpc.StatusCode.INVALID_ARGUMENT
        assert upload(pb.UploadBlobsRequest(chunk=b"a")) == grpc.StatusCode.INVALID_ARGUMENT
        assert upload(begin(5 << 20), pb.UploadBlobsRequest(chunk=b"a" * (5 << 20))) in REFUSED
        assert upload(begin(3, b"abc"), pb.UploadBlobsRequest(chunk=b"abc")) == grpc.StatusCode.OK
        incoming = [p for p in (target.folder / "data").rglob("incoming-*")]
        assert not incoming, f"half uploads stay: {incoming}"
        assert target.megabytes() < 1000, target.megabytes()


def zstd_bomb(gigabytes):
    """A zstd frame of zeros: a block of 128 KiB takes four bytes."""
    block = (1 << 17) << 3 | 1 << 1  # run-length
    blocks = gigabytes << 13
    size = (blocks << 17).to_bytes(8, "little")
    body = block.to_bytes(3, "little") + b"\0"
    return b"\x28\xb5\x2f\xfd" + b"\xe0" + size + body * (blocks - 1) + (block | 1).to_bytes(3, "little") + b"\0"


def test_partials(bin_dir):
    """A worker that hands in bombs and rubbish: refused, counted, and the coordinator stays small."""
    with Target(bin_dir) as target:
        job = target.job()[0]
        worker, pb, types = target.worker(), PB["worker_pb2"], PB["types_pb2"]

        def commit(who, key, data, size=None, digest=None):
            header = pb.CommitRequest.Header(worker_id=who, key=key, size=len(data) if size is None else size,
                                             digest=digest or hashlib.sha256(data).hexdigest())
            messages = [pb.CommitRequest(header=header)]
            messages += [pb.CommitRequest(chunk=data[i:i + (1 << 20)]) for i in range(0, len(data), 1 << 20)]
            return worker.Commit(iter(messages))

        bomb = zstd_bomb(16)
        refused = 0
        for data in (bomb, b"", b"\0" * 1000, bomb[:100], os.urandom(5000), b"\xff" * 200):
            who = target.register(worker)
            answer = worker.Lease(pb.LeaseRequest(worker_id=who, wait_seconds=1))
            if not answer.HasField("grant"):
                continue
            grant = answer.grant
            key = grant.key
            for size in {1 << 62, len(data) + 1, max(0, len(data) - 1)} - {len(data)}:
                assert code_of(lambda: commit(who, key, data, size)) in REFUSED + (grpc.StatusCode.OK,)
            code = code_of(lambda: commit(who, key, data, digest="0" * 64))
            assert code in REFUSED, code
            other = types.LeaseKey(job_id=key.job_id, tile_id=key.tile_id, attempt=key.attempt + 1)
            third = types.LeaseKey(job_id=key.job_id, tile_id=1 << 60, attempt=-1)
            for wrong in (other, third):
                assert code_of(lambda: commit(who, wrong, data)) in REFUSED + (grpc.StatusCode.OK,)
            try:
                outcome = commit(who, key, data).outcome
                assert outcome == types.COMMIT_OUTCOME_CORRUPT, outcome
                refused += 1
            except grpc.RpcError as error:
                assert error.code() in REFUSED, error
        assert refused >= 3, refused
        status = target.client().GetJob(PB["client_pb2"].GetJobRequest(job_id=job)).job
        assert status.packets_done == 0, "rubbish was merged"
        assert code_of(lambda: worker.Lease(pb.LeaseRequest(worker_id=who, wait_seconds=float("nan")))) in REFUSED
        assert code_of(lambda: worker.Lease(pb.LeaseRequest(worker_id=who, wait_seconds=1e300))) in REFUSED
        assert target.megabytes() < 500, target.megabytes()


def test_quotas(bin_dir):
    """Open jobs and submissions of one token are bounded; another token's are its own."""
    with Target(bin_dir, "--max-open-jobs", 4, "--submit-rate", 12) as target:
        target.run("lightmill-coordinator", "grant", "bob", "--dir", target.credentials)
        request = PB["client_pb2"].SubmitJobRequest
        target.cli("submit", ROOM)  # the first of the burst of two
        client, bob = target.client(), target.client("bob")
        empty = [code_of(lambda: client.SubmitJob(request())) for _ in range(12)]
        assert grpc.StatusCode.RESOURCE_EXHAUSTED in empty and grpc.StatusCode.INVALID_ARGUMENT in empty, empty
        said = target.cli("submit", ROOM, expect=3).stderr
        assert "more than 12 jobs a minute" in said and said.count("\n") == 1, said
        assert code_of(lambda: bob.SubmitJob(request())) == grpc.StatusCode.INVALID_ARGUMENT
    with Target(bin_dir, "--max-open-jobs", 2) as target:
        target.cli("submit", ROOM)
        target.cli("submit", ROOM)
        said = target.cli("submit", ROOM, expect=3).stderr
        assert "2 jobs that have not ended" in said, said
        target.cli("cancel", "j1")
        target.cli("submit", ROOM)


def test_connections(bin_dir):
    """Crowds of silent connections keep nobody who is in from working, and nobody out once they are gone."""
    with Target(bin_dir, "--max-connections", 30) as target:
        client, ask = target.client(), PB["client_pb2"].ListJobsRequest()
        assert code_of(lambda: client.ListJobs(ask)) == grpc.StatusCode.OK
        crowd = []
        for _ in range(400):
            crowd.append(socket.create_connection(("127.0.0.1", target.rpc), timeout=GENEROUS_S))
        assert code_of(lambda: client.ListJobs(ask)) == grpc.StatusCode.OK

        def closed(connection):
            connection.setblocking(False)
            try:
                return connection.recv(1) == b""
            except BlockingIOError:
                return False
            except OSError:
                return True

        end = time.monotonic() + GENEROUS_S
        while sum(closed(c) for c in crowd) < 370:
            assert time.monotonic() < end, "the crowd was let in"
            time.sleep(0.05)
        for connection in crowd:
            connection.close()
        target.cli("jobs")
    with Target(bin_dir, "--connection-rate", 1) as target:
        for _ in range(30):
            socket.create_connection(("127.0.0.1", target.rpc), timeout=GENEROUS_S).close()
        time.sleep(2)  # then one more may come in
        assert code_of(lambda: target.client().ListJobs(PB["client_pb2"].ListJobsRequest(), wait_for_ready=True,
                                                        timeout=GENEROUS_S)) == grpc.StatusCode.OK
        slow = []
        for _ in range(20):  # half a request to HTTP, and then nothing
            slow.append(socket.create_connection(("127.0.0.1", target.http), timeout=GENEROUS_S))
            slow[-1].send(b"GET /healthz HT")
        assert target.process.poll() is None


def test_hung(bin_dir):
    """Peers that answer pings and do nothing else: their calls end by themselves, what these held is free again, and however
    many there are, farm and users go on."""
    pb, work = PB["client_pb2"], PB["worker_pb2"]
    released = threading.Event()

    def silent_after(message):
        yield message
        released.wait(GENEROUS_S)

    def ended(calls):
        return [c for c in calls if c.done()]

    def wait(what, condition):
        end = time.monotonic() + GENEROUS_S
        while not condition():
            assert time.monotonic() < end, f"still waiting for: {what}"
            time.sleep(0.05)

    with Target(bin_dir, "--stall-seconds", 4) as target:
        client, worker = target.client(), target.worker()
        job, settings, bundle, _ = target.job()

        crowd = [target.client() for _ in range(8)]
        watching = [crowd[i % 8].WatchJob(pb.WatchJobRequest(job_id=job)) for i in range(600)]
        assert next(client.WatchJob(pb.WatchJobRequest(job_id=job))).job.id == job, "watchers take no places from others"
        assert code_of(lambda: client.GetJob(pb.GetJobRequest(job_id=job), timeout=GENEROUS_S)) == grpc.StatusCode.OK
        who = target.register(worker)
        assert code_of(lambda: worker.Renew(work.RenewRequest(worker_id=who), timeout=GENEROUS_S)) == grpc.StatusCode.OK
        assert not ended(watching), "all watch on"
        for call in watching:
            call.cancel()

        wide = json.dumps({**settings, "width": 1920, "height": 1080, "crop": [0, 0, 1920, 1080]})
        job = client.SubmitJob(pb.SubmitJobRequest(bundle_json=json.dumps(bundle), settings_json=wide)).job_id
        client.CancelJob(pb.CancelJobRequest(job_id="j1"))
        key = worker.Lease(work.LeaseRequest(worker_id=who, wait_seconds=10)).grant.key
        header = work.CommitRequest(header=work.CommitRequest.Header(worker_id=who, key=key, size=110 * 10**6, digest="0" * 64))
        hung = [worker.Commit.future(silent_after(header)) for _ in range(20)]
        wait("hung commits to end", lambda: len(ended(hung)) == len(hung))
        refused = [c for c in hung if c.code() == grpc.StatusCode.RESOURCE_EXHAUSTED]
        assert 0 < len(refused) < len(hung), "512 MiB at once, and no more"

        def late():  # callers are told that they were cut off before what they held is let go
            call = worker.Commit.future(silent_after(header))
            wait("a hung commit to end", call.done)
            return call.code()
        wait("what they held to be free again", lambda: late() != grpc.StatusCode.RESOURCE_EXHAUSTED)
        assert target.megabytes() < 500, target.megabytes()

        begin = pb.UploadBlobsRequest(header=pb.UploadBlobsRequest.Header(digest=hashlib.sha256(b"abc").hexdigest(), size=3))
        hung = [crowd[i % 8].UploadBlobs.future(silent_after(begin)) for i in range(400)]
        content = bytes(32 << 20)
        digest = hashlib.sha256(content).hexdigest()
        whole = [pb.UploadBlobsRequest(header=pb.UploadBlobsRequest.Header(digest=digest, size=len(content)))]
        whole += [pb.UploadBlobsRequest(chunk=content[i:i + (1 << 20)]) for i in range(0, len(content), 1 << 20)]
        wait("an upload to be let in", lambda: code_of(lambda: client.UploadBlobs(iter(whole))) == grpc.StatusCode.OK)
        wait("hung uploads to end", lambda: len(ended(hung)) == len(hung))
        assert {c.code() for c in hung} <= {grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.CANCELLED}
        wait("half uploads to go", lambda: not list((target.folder / "data").rglob("incoming-*")))

        ask = work.FetchBlobsRequest(digests=[digest])
        unread = [worker.FetchBlobs(ask) for _ in range(80)]
        reader = target.worker()  # a connection of its own: who reads nothing fills the other's window
        assert sum(len(m.chunk) for m in reader.FetchBlobs(ask)) == len(content), "others are served meanwhile"
        assert target.megabytes() < 500, target.megabytes()
        for call in unread:
            call.cancel()
        assert sum(len(m.chunk) for m in worker.FetchBlobs(ask)) == len(content)
        released.set()


def test_streams(bin_dir):
    """Calls of one connection at once, by a client that keeps to the server's bound and by two that do not."""
    with Target(bin_dir) as target:
        check_streams(target)


def grey_png(path, side):
    """A picture of zeros: a few hundred kilobytes for any number of pixels."""
    def chunk(kind, data):
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(b"\0" * (side + 1)) for _ in range(side)) + packer.flush()
    header = side.to_bytes(4, "big") * 2 + b"\x08\0\0\0\0"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b""))


def test_bombs(bin_dir):
    """Scenes whose pictures are bombs: refused by their headers or by the worker's memory limit, with the tile's
    name; the worker goes on, in its sandbox, with decent work."""
    scene = """Camera "perspective" Film "rgb" "integer xresolution" 16 "integer yresolution" 16 WorldBegin
        LightSource "infinite" Texture "t" "spectrum" "imagemap" "string filename" "bomb.png"
        Material "diffuse" "texture reflectance" "t" Translate 0 0 3 Shape "sphere" """
    with Target(bin_dir, "--max-attempts", 1) as target:
        log = target.folder / "worker.log"
        with open(log, "wb") as out:
            worker = subprocess.Popen(
                [target.bin / "lightmill-worker", "--coordinator", f"127.0.0.1:{target.rpc}", "--threads", "1",
                 "--memory-limit", "600M", "--cache-dir", target.folder / "cache", "--credentials",
                 target.credentials / "worker"], stdout=out, stderr=out)
        try:
            for side, reason in ((40000, "texture size is not supported"), (20000, "texture size is not supported"),
                                 (16000, "out of memory: it takes more than the 0.6 GiB of this worker")):
                folder = target.folder / f"bomb{side}"
                folder.mkdir()
                grey_png(folder / "bomb.png", side)
                (folder / "scene.pbrt").write_text(scene)
                job = target.cli("submit", folder / "scene.pbrt", "--integrator", "pt", "--spp", 4).stdout.strip()
                target.cli("watch", job, expect=1)
                said = json.loads(target.cli("job", job, "--json").stdout)["message"]
                assert reason in said and "tile" in said, said
                assert worker.poll() is None, log.read_text()
            status = pathlib.Path(f"/proc/{worker.pid}/status").read_text()
            assert "NoNewPrivs:\t1" in status and "Seccomp:\t2" in status, status
            peak = int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024
            assert peak < 900, f"{peak} MB"
            target.cli("submit", ROOM, "--resolution", "32x32", "--spp", 16, "--wait", "-o", target.folder / "good.exr")
        finally:
            worker.kill()
            worker.wait()


def test_workers(bin_dir):
    """Workers say in a line why they are not let in, and exit with 3; what may pass they wait for."""
    with Target(bin_dir) as target:
        def worker(*flags, expect=3):
            done = target.run("lightmill-worker", "--coordinator", f"127.0.0.1:{target.rpc}", "--threads", 1,
                              "--cache-dir", target.folder / "cache", *flags, expect=expect)
            return done.stderr.strip().splitlines()[-1]

        other = target.folder / "other-farm"
        target.run("lightmill-coordinator", "init", "--dir", other)
        here = target.credentials
        assert "it speaks TLS; give --credentials" in worker()
        assert "has the role submitter; this needs worker" in worker("--credentials", here / "client")
        assert "was not signed by the CA in" in worker("--credentials", other / "worker")
        assert "does not accept our certificate" in worker(
            "--credentials", here / "worker", "--tls-cert", other / "worker/tls.crt", "--tls-key",
            other / "worker/tls.key")
        assert "the token is not known here" in worker("--credentials", here / "worker", "--token-file",
                                                       other / "worker/token")
        assert "can't be read" in worker("--credentials", "/nonexistent", expect=2)
        said = target.run("lightmill-worker", "--coordinator", "10.1.1.1:1", expect=2).stderr
        assert "would be plain text" in said and "--credentials" in said and "--insecure" in said, said


def main():
    tests = {"strangers": test_strangers, "roles": test_roles, "paths": test_paths, "sizes": test_sizes,
             "partials": test_partials, "quotas": test_quotas, "connections": test_connections, "hung": test_hung,
             "streams": test_streams, "bombs": test_bombs, "workers": test_workers}
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("parts", nargs="*", choices=[[], *tests], help="default: all")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightmill-stubs-") as stubs:
        load_proto(stubs)
        for name in arguments.parts or tests:
            start = time.monotonic()
            tests[name](arguments.bin)
            print(f"ok {name} ({time.monotonic() - start:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
