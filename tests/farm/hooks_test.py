"""Hooks: a URL and a command are told when jobs and sequences end, also across a crash of the coordinator.

    hooks_test.py --bin build/release/bin
"""
import argparse
import base64
import hashlib
import hmac
import http.server
import json
import pathlib
import subprocess
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import Farm, wait_until  # noqa: E402
from paths import ROOT  # noqa: E402

SCENE = ROOT / "scenes" / "cornell-spheres.pbrt"
ANIMATED = ROOT / "scenes" / "windmill.gltf"
OPTIONS = ["--resolution", "16x16", "--spp", 4]


class Receiver:
    """Takes what a hook posts; refuses the first so many."""

    def __init__(self, refusals=0):
        self.got = []
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                nonlocal refusals
                body = self.rfile.read(int(self.headers["Content-Length"]))
                refusals -= 1
                taken = refusals < 0
                if taken:
                    receiver.got.append((dict(self.headers), body))
                self.send_response(204 if taken else 503)
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/done"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


def check_signature(secret, headers, body):
    """As the Standard Webhooks specification says."""
    key = base64.b64decode(secret.removeprefix("whsec_"))
    text = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    expected = "v1," + base64.b64encode(hmac.new(key, text, hashlib.sha256).digest()).decode()
    assert expected in headers["webhook-signature"].split(), headers


def test_hooks(bin_dir):
    receiver = Receiver(refusals=1)
    with Farm(bin_dir) as farm:
        told = farm.folder / "told"
        farm.coordinator_options = ["--on-done", receiver.url, "--on-done",
                                    f"cat >> '{told}'; echo \" $LIGHTMILL_EVENT $LIGHTMILL_ID\" >> '{told}'"]
        farm.start_coordinator()
        farm.start_worker(1)
        job = farm.submit(SCENE, *OPTIONS, "--name", "a \"kitchen\"")
        farm.lightmill("watch", job)
        wait_until("the command", lambda: told.exists() and told.read_text().endswith(f" job.done {job}\n"))
        message = json.loads(told.read_text().removesuffix(f" job.done {job}\n"))
        assert message["type"] == "job.done" and message["data"]["id"] == job, message
        assert message["data"]["name"] == 'a "kitchen"' and message["data"]["spp"] == 4, message
        wait_until("the second try of the URL", lambda: receiver.got)
        headers, body = receiver.got[0]
        assert json.loads(body) == message and headers["webhook-id"] == f"{job}.1", headers
        secret = farm.folder / "data" / "hook-secret"
        assert secret.stat().st_mode & 0o777 == 0o600
        check_signature(secret.read_text().strip(), headers, body)

        shot = farm.submit(ANIMATED, *OPTIONS, "--frames", "1-3")
        farm.lightmill("watch", shot)
        wait_until("the sequence", lambda: len(receiver.got) == 2)
        sequence = json.loads(receiver.got[1][1])
        assert sequence["type"] == "sequence.done" and sequence["data"]["id"] == shot, sequence
        wait_until("the command", lambda: told.read_text().count("\n") == 2)
    receiver.close()


def test_crash(bin_dir):
    """What nobody was told before a crash is told after it."""
    with Farm(bin_dir) as farm:
        marker, told = farm.folder / "open", farm.folder / "told"
        farm.coordinator_options = ["--on-done", f"test -e '{marker}' && echo $LIGHTMILL_ID >> '{told}'"]
        farm.start_coordinator()
        job = farm.submit(SCENE, *OPTIONS)
        farm.lightmill("cancel", job)
        wait_until("a line in the log", lambda: "is tried again" in (farm.folder / "coordinator.log").read_text())
        farm.kill_coordinator()
        marker.touch()
        farm.start_coordinator()
        wait_until("the command", lambda: told.exists() and told.read_text() == f"{job}\n")


def test_refusals(bin_dir):
    with Farm(bin_dir) as farm:
        for what in ("http://", "https://a b/", "http://user:word@host/", ""):
            done = subprocess.run([pathlib.Path(bin_dir) / "lightmill-coordinator", "--data", farm.folder / "d", "--on-done",
                                   what], capture_output=True, text=True, check=False)
            assert done.returncode == 2 and len(done.stderr.splitlines()) == 1, done
            assert "--on-done" in done.stderr, done.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", required=True)
    arguments = parser.parse_args()
    for test in (test_hooks, test_crash, test_refusals):
        test(arguments.bin)
        print(f"ok {test.__name__}")


if __name__ == "__main__":
    main()
