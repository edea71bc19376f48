"""The Python client of client/python: it submits, watches and fetches, and its picture is the CLI's. Of several
coordinators it finds the one that leads, also when that one dies and comes back.

    python_client_test.py --bin build/release/bin
"""
import argparse
import concurrent.futures
import pathlib
import shutil
import subprocess
import sys

try:
    import google.protobuf  # noqa: F401
    import grpc  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}; install python3-grpcio and python3-protobuf")
    sys.exit(77)
if not shutil.which("grpc_python_plugin"):
    print("skipped: there is no grpc_python_plugin; install protobuf-compiler-grpc")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm, pixels  # noqa: E402
from paths import ROOM, ROOT  # noqa: E402
import numpy  # noqa: E402


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=GENEROUS_S)


class Standby(grpc.GenericRpcHandler):
    """Answers every call as a coordinator does while another one leads."""

    def service(self, _details):
        return grpc.unary_unary_rpc_method_handler(
            lambda _request, context: context.abort(grpc.StatusCode.UNAVAILABLE, "standby: another one leads"))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Farm(arguments.bin) as farm:
        client = farm.folder / "client"
        shutil.copytree(ROOT / "client" / "python", client, ignore=shutil.ignore_patterns("generated"))
        made = run(ROOT / "client" / "python" / "generate.sh", client / "generated")
        assert made.returncode == 0, made.stderr

        gone = run("/usr/bin/python3", client / "render.py", ROOM, "--coordinator", "127.0.0.1:1", "-o", "x.pfm")
        assert gone.returncode == 1 and "127.0.0.1:1: " in gone.stderr and "Traceback" not in gone.stderr, gone.stderr

        standby = grpc.server(concurrent.futures.ThreadPoolExecutor(1), handlers=[Standby()])
        waiting = f"127.0.0.1:{standby.add_insecure_port('127.0.0.1:0')}"
        standby.start()
        gone = run("/usr/bin/python3", client / "render.py", ROOM, "--coordinator", f"127.0.0.1:1,{waiting}",
                   "-o", "x.pfm")
        assert gone.returncode == 1 and "standby: another one leads" in gone.stderr, gone.stderr

        farm.start_coordinator()
        farm.start_worker(2)
        output = farm.folder / "python.pfm"
        options = ["--spp", 32, "--integrator", "pt", "--seed", 5]
        everybody = f"127.0.0.1:1,{waiting},{farm.address}"
        done = run("/usr/bin/python3", client / "render.py", ROOM, "--coordinator", everybody, "--size", "64x48",
                   *options, "-o", output)
        assert done.returncode == 0, done.stderr
        job = done.stdout.strip()
        assert farm.json("job", job)["state"] == "done"
        assert f"{job} done" in done.stderr, done.stderr
        reference = farm.render("cli.exr", ROOM, "--resolution", "64x48", *options, "--max-depth", 5)
        assert numpy.array_equal(pixels(output), pixels(reference)), "the clients' pictures differ"

        long = ["--spp", 2048, "--integrator", "bdpt", "--seed", 6]
        command = ["/usr/bin/python3", client / "render.py", ROOM, "--coordinator", everybody, "--size", "64x48", *long,
                   "-o", output]
        watching = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True)
        job = watching.stdout.readline().strip()
        farm.wait_for_packets(job, 10)
        farm.kill_coordinator()
        farm.start_coordinator()
        assert watching.wait(timeout=GENEROUS_S) == 0, "a client that watches goes back to whoever leads"
        reference = farm.render("long.exr", ROOM, "--resolution", "64x48", *long, "--max-depth", 5)
        assert numpy.array_equal(pixels(output), pixels(reference)), "the clients' pictures differ"
        standby.stop(None)
        print("ok")


if __name__ == "__main__":
    main()
