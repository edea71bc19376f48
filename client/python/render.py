#!/usr/bin/python3
"""Submits a scene to a Lightmill farm, follows it and fetches the picture: all that a client in any language does.

    client/python/generate.sh                        # once: the protocol's classes, into client/python/generated
    client/python/render.py scenes/cornell-spheres.pbrt --spp 64 -o picture.pfm

Needs Debian's python3-grpcio, python3-protobuf, protobuf-compiler and protobuf-compiler-grpc. The protocol is
explained in proto/lightmill/v1/client.proto, RPC by RPC with its errors.
"""
import argparse
import hashlib
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "generated"))
import grpc  # noqa: E402
from lightmill.v1 import client_pb2, client_pb2_grpc, types_pb2  # noqa: E402

LOOK_S = 3  # whether a coordinator is there, and leads
DEADLINE_S = 10  # transfers and streams have longer ones
TRANSFER_S = 3600
RECONNECT_S = 60  # by then a coordinator that restarts is back, or its standby has taken over
CHUNK = 1 << 20
LOST = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED, grpc.StatusCode.CANCELLED,
        grpc.StatusCode.UNKNOWN, grpc.StatusCode.INTERNAL)


def leader(farms):
    """Of the stubs of all coordinators the one that leads. A standby says UNAVAILABLE to everything, as if it were
    away; the question changes nothing, so that it may be asked of each."""
    lost = None
    for farm in farms:
        try:
            farm.GetJob(client_pb2.GetJobRequest(), timeout=LOOK_S)
        except grpc.RpcError as error:
            if error.code() in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
                lost = error
                continue
        return farm
    raise lost


def canonical(value):
    """Manifest and settings travel as JSON with sorted keys and without blanks."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def bundle_of(scene, extra_files):
    """A scene's manifest and its blobs by digest. Names are as the scene writes them, relative to its folder."""
    folder = scene.resolve().parent
    blobs, entries = {}, []
    for path in sorted({scene.resolve(), *(f.resolve() for f in extra_files)}):
        content = path.read_bytes()
        digest = hashlib.sha256(content).hexdigest()
        blobs[digest] = content
        entries.append({"name": str(path.relative_to(folder)), "digest": digest, "size": len(content)})
    entries.sort(key=lambda entry: entry["name"].encode())
    return {"version": 1, "main": scene.name, "entries": entries}, blobs


def settings_of(width, height, spp, integrator, seed):
    """What common/job/settings.h calls RenderSettings. Unlike the CLI, nothing here reads the scene's own film."""
    return {"integrator": integrator, "width": width, "height": height, "crop": [0, 0, width, height], "spp": spp,
            "max_depth": 5, "seed": seed, "time_s": 0.0, "target_error": 0.0, "energy_compensation": False,
            "overrides": "", "plan": None}


def upload(farm, blobs):
    """Sends the blobs that the farm lacks: a header, then chunks, one blob after the other."""
    missing = farm.FindMissingBlobs(client_pb2.FindMissingBlobsRequest(digests=blobs), timeout=DEADLINE_S).digests

    def messages():
        for digest in missing:
            content = blobs[digest]
            yield client_pb2.UploadBlobsRequest(header={"digest": digest, "size": len(content)})
            for at in range(0, len(content), CHUNK):
                yield client_pb2.UploadBlobsRequest(chunk=content[at:at + CHUNK])

    if missing:
        farm.UploadBlobs(messages(), timeout=TRANSFER_S)


def print_status(job_id, status):
    state = types_pb2.JobState.Name(status.state).removeprefix("JOB_STATE_").lower()
    error = f"  relMSE {status.relmse:.3g}" if status.HasField("relmse") else ""
    print(f"{job_id} {state}: {status.packets_done}/{status.packets_total} packets, {status.spp:.4g} spp{error}",
          file=sys.stderr)


def watch(farms, job_id):
    """Prints a line per status until the job has ended; returns the last one. Goes to another coordinator, or waits
    for the same one, when its own is lost."""
    last, give_up = None, None
    while True:
        try:
            for message in leader(farms).WatchJob(client_pb2.WatchJobRequest(job_id=job_id), timeout=24 * 3600):
                last, give_up = message.job, None
                print_status(job_id, last)
            return last
        except grpc.RpcError as error:
            give_up = give_up or time.monotonic() + RECONNECT_S
            if error.code() not in LOST or time.monotonic() > give_up:
                raise
            time.sleep(1)


def fetch(farm, job_id):
    """The picture as (width, height, little-endian floats: RGB, row by row from the top)."""
    header, pixels = None, bytearray()
    for message in farm.FetchImage(client_pb2.FetchImageRequest(job_id=job_id), timeout=TRANSFER_S):
        if message.HasField("header"):
            header = message.header
        else:
            pixels += message.chunk
    assert len(pixels) == 12 * header.width * header.height
    return header.width, header.height, bytes(pixels)


def write_pfm(path, width, height, pixels):
    row = 12 * width
    with open(path, "wb") as out:
        out.write(b"PF\n%d %d\n-1.0\n" % (width, height))
        for y in reversed(range(height)):  # PFM begins at the bottom
            out.write(pixels[y * row:(y + 1) * row])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("files", type=pathlib.Path, nargs="*", help="what the scene includes: meshes, textures")
    parser.add_argument("--coordinator", default="localhost:7070",
                        help="HOST:PORT; with standbys all of them, with commas between")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", default="320x240", help="WxH")
    parser.add_argument("--integrator", default="auto", choices=["auto", "bdpt", "pt", "lt"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", required=True, help="a .pfm file")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    manifest, blobs = bundle_of(arguments.scene, arguments.files)
    settings = settings_of(width, height, arguments.spp, arguments.integrator, arguments.seed)

    # On one machine. To another one take grpc.secure_channel and send the token: see proto/lightmill/v1.
    farms = [client_pb2_grpc.ClientServiceStub(grpc.insecure_channel(address))
             for address in arguments.coordinator.split(",")]
    try:
        farm = leader(farms)
        upload(farm, blobs)
        job_id = farm.SubmitJob(client_pb2.SubmitJobRequest(
            name=arguments.scene.stem, bundle_json=canonical(manifest), settings_json=canonical(settings)),
            timeout=DEADLINE_S).job_id
        print(job_id, flush=True)
        last = watch(farms, job_id)
        if last.state != types_pb2.JOB_STATE_DONE:
            sys.exit(f"{job_id} did not finish: {last.message}")
        write_pfm(arguments.output, *fetch(leader(farms), job_id))
    except grpc.RpcError as error:  # details() is one line for the user
        sys.exit(f"{arguments.coordinator}: {error.details()}")


if __name__ == "__main__":
    main()
