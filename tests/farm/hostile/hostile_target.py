"""What hostile clients are tried on: a coordinator with TLS, tokens and low quotas."""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))  # what tests/farm shares
from paths import ROOM  # noqa: E402
from wire import PB  # noqa: E402
import grpc  # noqa: E402
from google.protobuf import descriptor_pb2  # noqa: E402

GENEROUS_S = 120  # only a hang takes so long
REFUSED = (grpc.StatusCode.INVALID_ARGUMENT, grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.FAILED_PRECONDITION,
           grpc.StatusCode.NOT_FOUND)
OPTIONS = [("grpc.max_send_message_length", 1 << 30), ("grpc.max_receive_message_length", 1 << 30),
           ("grpc.use_local_subchannel_pool", 1)]  # a connection to every channel


class Target:
    """A coordinator with TLS, tokens and low quotas, and what a stranger needs to talk to it."""

    def __init__(self, bin_dir, *flags):
        self.bin = pathlib.Path(bin_dir).resolve()
        self.temporary = tempfile.TemporaryDirectory(prefix="lightmill-hostile-")
        self.folder = pathlib.Path(self.temporary.name)
        self.credentials = self.folder / "credentials"
        self.run("lightmill-coordinator", "init", "--dir", self.credentials)
        self.log = open(self.folder / "log", "wb")
        self.process = subprocess.Popen(
            [self.bin / "lightmill-coordinator", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--data",
             self.folder / "data", "--port-file", self.folder / "port", "--credentials",
             self.credentials / "coordinator", *map(str, flags)], stdout=self.log, stderr=self.log)
        end = time.monotonic() + GENEROUS_S
        while not (self.folder / "port").exists():
            assert self.process.poll() is None and time.monotonic() < end, (self.folder / "log").read_text()
            time.sleep(0.02)
        ports = dict(line.split("=") for line in (self.folder / "port").read_text().split())
        self.rpc, self.http = int(ports["rpc"]), int(ports["http"])
        self.channels = []

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        for channel in self.channels:
            channel.close()
        alive = self.process.poll() is None
        self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = "a hang"
        text = (self.folder / "log").read_text(errors="replace")
        self.log.close()
        self.temporary.cleanup()
        if kind:
            print(text[-3000:])
        else:
            assert alive and code == 0, f"the coordinator ended with {code}:\n{text[-3000:]}"

    def run(self, program, *arguments, expect=0, **environment):
        done = subprocess.run([self.bin / program, *map(str, arguments)], capture_output=True, text=True,
                              timeout=GENEROUS_S, env={**os.environ, **environment})
        assert done.returncode == expect, f"{program} {arguments}: exit {done.returncode}: {done.stderr[-500:]}"
        return done

    def cli(self, *arguments, holder="client", expect=0):
        return self.run("lightmill", *arguments, "--coordinator", f"127.0.0.1:{self.rpc}", "--credentials",
                        self.credentials / holder, expect=expect)

    def token(self, holder):
        return (self.credentials / holder / "token").read_text().strip()

    def channel(self, holder, token=None, certificate=True):
        folder = self.credentials / holder
        secure = grpc.ssl_channel_credentials(
            (folder / "ca.crt").read_bytes(), (folder / "tls.key").read_bytes() if certificate else None,
            (folder / "tls.crt").read_bytes() if certificate else None)
        if token:
            secure = grpc.composite_channel_credentials(secure, grpc.access_token_call_credentials(token))
        channel = grpc.secure_channel(f"localhost:{self.rpc}", secure, options=OPTIONS)
        self.channels.append(channel)
        return channel

    def client(self, holder="client"):
        return PB["client_pb2_grpc"].ClientServiceStub(self.channel(holder, self.token(holder)))

    def worker(self):
        return PB["worker_pb2_grpc"].WorkerServiceStub(self.channel("worker", self.token("worker")))

    def register(self, worker):
        """The id of a worker that says what a good one would."""
        build = self.run("lightmill-coordinator", "--version").stdout.strip()
        schema = int(re.search(r" schema (\d+),", build).group(1))
        registration = PB["types_pb2"].WorkerRegistration(host="evil", threads=1, build=build, schema=schema,
                                                          arithmetic_class="0" * 64)
        return worker.Register(PB["worker_pb2"].RegisterRequest(registration=registration)).worker_id

    def megabytes(self):
        """Of the coordinator's peak memory."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024

    def job(self, *options):
        """Submits a job as a user does, and learns the wire's texts from it: (id, settings, bundle, status)."""
        self.cli("submit", ROOM, "--integrator", "bdpt", "--spp", 16, "--resolution", "64x64", *options)
        status = self.client().ListJobs(PB["client_pb2"].ListJobsRequest()).jobs[-1]
        bundle = self.worker().GetBundle(PB["worker_pb2"].GetBundleRequest(bundle_digest=status.bundle_digest))
        return status.id, json.loads(status.settings_json), json.loads(bundle.bundle_json), status


def code_of(call):
    """The status with which a call ends; streams are read to their end."""
    try:
        result = call()
        if hasattr(result, "__next__"):
            for _ in result:
                pass
        return grpc.StatusCode.OK
    except grpc.RpcError as error:
        text = error.details() or ""
        assert "\n" not in text and len(text) <= 1500, f"more than a line: {text!r}"
        return error.code()


def methods():
    """(path, streams requests, streams responses) of every RPC."""
    for file, service in (("client_pb2", "ClientService"), ("sequence_pb2", "SequenceService"),
                          ("worker_pb2", "WorkerService")):
        proto = PB[file].DESCRIPTOR.serialized_pb
        for method in descriptor_pb2.FileDescriptorProto.FromString(proto).service[0].method:
            yield f"/lightmill.v1.{service}/{method.name}", method.client_streaming, method.server_streaming


def raw_call(channel, path, streams_in, streams_out, body=b"", metadata=None):
    """Calls an RPC with bytes of one's own."""
    same = {"request_serializer": None, "response_deserializer": None}
    if streams_in:
        return channel.stream_unary(path, **same)(iter([body]), timeout=GENEROUS_S, metadata=metadata)
    make = channel.unary_stream if streams_out else channel.unary_unary
    return make(path, **same)(body, timeout=GENEROUS_S, metadata=metadata)
