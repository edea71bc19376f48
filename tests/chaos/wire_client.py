"""What the bench asks a coordinator, without a program's start for every question; the CLI has tests of its own."""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "farm"))
from wire import PB  # noqa: E402
import grpc  # noqa: E402

PATIENCE_S = 120  # for what must be answered; only a hang takes so long
PATIENT = {"timeout": PATIENCE_S, "wait_for_ready": True}
# A connection of its own for every farm, and no long waits for a coordinator that comes back.
OPTIONS = [("grpc.use_local_subchannel_pool", 1), ("grpc.initial_reconnect_backoff_ms", 100),
           ("grpc.max_reconnect_backoff_ms", 200), ("grpc.max_receive_message_length", 1 << 30)]


class Recording:
    """A submission, as the coordinator got it from the CLI: it can be made again without one."""

    def __init__(self, wire, job):
        status = wire.client.GetJob(PB["client_pb2"].GetJobRequest(job_id=job), **PATIENT).job
        self.settings_json = status.settings_json
        ask = PB["worker_pb2"].GetBundleRequest(bundle_digest=status.bundle_digest)
        self.bundle_json = wire.worker.GetBundle(ask, **PATIENT).bundle_json
        digests = {entry["digest"] for entry in json.loads(self.bundle_json)["entries"]}
        self.blobs = []
        for message in wire.worker.FetchBlobs(PB["worker_pb2"].FetchBlobsRequest(digests=sorted(digests)),
                                              **PATIENT):
            if message.HasField("header"):
                self.blobs.append([message.header.digest, message.header.size, b""])
            else:
                self.blobs[-1][2] += message.chunk


class Wire:
    def __init__(self, address):
        self.channel = grpc.insecure_channel(address, options=OPTIONS)
        self.client = PB["client_pb2_grpc"].ClientServiceStub(self.channel)
        self.worker = PB["worker_pb2_grpc"].WorkerServiceStub(self.channel)

    def close(self):
        self.channel.close()

    def status(self, job):
        """None if the coordinator does not answer."""
        try:
            return self.client.GetJob(PB["client_pb2"].GetJobRequest(job_id=job), timeout=5).job
        except grpc.RpcError as error:
            assert error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED,
                                    grpc.StatusCode.CANCELLED), f"{job}: {error}"
            return None

    def submit(self, recording):
        request = PB["client_pb2"].UploadBlobsRequest

        def upload():
            for digest, size, content in recording.blobs:
                yield request(header=request.Header(digest=digest, size=size))
                yield request(chunk=content)
        self.client.UploadBlobs(upload(), **PATIENT)
        submission = PB["client_pb2"].SubmitJobRequest(name="chaos", bundle_json=recording.bundle_json,
                                                       settings_json=recording.settings_json)
        return self.client.SubmitJob(submission, **PATIENT).job_id

    def tiles(self, job):
        """The ledger: id -> tile."""
        messages = self.client.ListTiles(PB["client_pb2"].ListTilesRequest(job_id=job), **PATIENT)
        return {tile.id: tile for message in messages for tile in message.tiles}

    def pixels(self, job):
        """Little-endian floats, row after row."""
        messages = self.client.FetchImage(PB["client_pb2"].FetchImageRequest(job_id=job), **PATIENT)
        return b"".join(message.chunk for message in messages)
