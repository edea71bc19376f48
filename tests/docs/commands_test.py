"""Every command of the documentation is executed, as it stands, in the order of its page.

    commands_test.py --bin build/release/bin [PAGE.md ...]

A page runs in a folder that looks like a built checkout, with the example scenes made small. What it starts as a server
runs until the page ends, on ports that are free; its database is a PostgreSQL of its own. Commands that can't run here
are listed below with the test that runs them instead; whatever is neither run nor listed fails.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from postgres import Missing, PostgresServer  # noqa: E402

SERVERS = ("lightmill-coordinator --listen", "lightmill-worker --coordinator 127.0.0.1")
DATABASE = "postgresql://lightmill@db.example.org/farm"
GENEROUS_S = 300
ELSEWHERE = [  # a pattern, and what runs such commands
    (r"^(docker|docker-compose) |^mkdir -p farm-credentials$|-C /var/lib/lightmill/credentials|^export LIGHTMILL_CRED",
     "tests/deploy/containers.sh, those of Compose and Swarm"),
    (r"^kubectl |kubectl apply|^deploy/kubernetes/|^export LIGHTMILL_STORE=",
     "tests/deploy/kubernetes.sh, as far as it needs no cluster"),
    (r"^deploy/swarm/|^export LIGHTMILL_SECRETS", "tests/deploy/swarm.sh"),
    (r"^sbatch |^export LIGHTMILL_(BIN|COORDINATOR)=", "tests/deploy/slurm.sh"),
    (r"^deploy/quickstart\.sh|^deploy/install_packages\.sh", "tests/deploy/quickstart.sh"),
    (r"^tests/run\.sh|^cmake --preset|^ctest ", "this very run"),
    (r"farm\.example\.org:7070|--credentials farm-credentials", "tests/farm/hostile/hostile_test.py, on the machines it has"),
    (r"^build/release/tests/extreme_suite|^tests/bench", "CTest, as the suite's own tests"),
    (r"^blender ", "tests/blender/engine_test.py, with a scene of its own"),
    (r"^cmake --(build|install) |^\(cd build && cpack |^~/lightmill/|^sudo (apt|systemctl|systemd-run) |^journalctl ",
     "tests/deploy/package.sh"),
    (r"^sudo -u postgres ", "tests/support/postgres.py, as far as a server of its own goes"),
]
PAGES_ELSEWHERE = {"security.md": "tests/farm/security_doc_test.py"}


def commands(page):
    """The lines of its ```sh blocks, continued ones joined, comments taken off."""
    for block in re.findall(r"^```sh\n(.*?)^```$", page.read_text(), re.M | re.S):
        for line in block.replace("\\\n", " ").splitlines():
            line = re.sub(r"\s+#\s.*$", "", re.sub(r"\s+", " ", line)).strip()
            if line:
                yield line


def checkout(folder, bin_dir):
    """What the pages' commands find: programs, scenes of few pixels, clients."""
    programs = folder / "build" / "release" / "bin"
    programs.mkdir(parents=True)
    for name in ("lightmill", "lightmill-coordinator", "lightmill-worker"):
        (programs / name).symlink_to(pathlib.Path(bin_dir).resolve() / name)
    for part in ("proto", "deploy", "LICENSE"):
        (folder / part).symlink_to(ROOT / part)
    shutil.copytree(ROOT / "client" / "python", folder / "client" / "python",
                    ignore=shutil.ignore_patterns("__pycache__", ".mypy_cache"))
    shutil.copytree(ROOT / "client" / "blender", folder / "client" / "blender", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "scenes", folder / "scenes")
    for scene in (folder / "scenes").glob("*.pbrt"):
        text = re.sub(r'("integer [xy]resolution") \d+', r"\1 24", scene.read_text())
        scene.write_text(re.sub(r'("integer pixelsamples") \d+', r"\1 4", text))


class Page:
    def __init__(self, path, bin_dir):
        self.path, self.bin = path, bin_dir
        self.servers, self.address, self.ports = [], None, {}
        self.database = None

    def __enter__(self):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="lightmill-docs-"))
        checkout(self.root, self.bin)
        self.folder = self.root
        return self

    def __exit__(self, *_):
        for server in self.servers:
            server.kill()
            server.wait()
        if self.database:
            self.database.close()
        shutil.rmtree(self.root, ignore_errors=True)

    def here(self, command):
        """The page's addresses as this test's."""
        command = re.sub(r"(?:127\.0\.0\.1|localhost):(\d+)",
                         lambda match: f"127.0.0.1:{self.ports.get(match[1], match[1])}", command)
        if DATABASE in command:
            self.database = self.database or PostgresServer()
            command = command.replace(DATABASE, f"'{self.database.url()}'")
        return command

    def serve(self, command):
        port_file = self.root / f"ports{len(self.servers)}"
        asked = {}  # what the page calls the ports
        if "coordinator --listen" in command:
            for kind, option in (("rpc", "listen"), ("http", "http")):
                if match := re.search(rf"--{option} 127\.0\.0\.1:(\d+)", command):
                    asked[kind] = match[1]
                    self.ports.pop(match[1], None)  # a server of before has ended
            command = re.sub(r"--(listen|http) 127\.0\.0\.1:\d+", r"--\1 127.0.0.1:0", command)
            command += f" --port-file {port_file}"
        log = open(self.root / f"server{len(self.servers)}.log", "wb")
        self.servers.append(subprocess.Popen("exec " + self.here(command), shell=True, cwd=self.folder, stdout=log,
                                             stderr=log))
        end = time.monotonic() + GENEROUS_S
        while "coordinator --listen" in command and not (port_file.exists() and "http=" in port_file.read_text()):
            assert self.servers[-1].poll() is None and time.monotonic() < end, f"{command}: it did not start"
            time.sleep(0.05)
        if port_file.exists():
            got = dict(line.split("=") for line in port_file.read_text().split())
            self.ports.update({asked[kind]: got[kind] for kind in asked})
            self.address = f"127.0.0.1:{got['rpc']}"

    def need_farm(self, command):
        """Pages that only say "with a farm on this machine" get one."""
        if self.address or not re.search(r"localhost:7070|lightmill (submit|watch|jobs|job|fetch|report j)", command):
            return
        self.serve("build/release/bin/lightmill-coordinator --listen 127.0.0.1:7070 --http 127.0.0.1:8080 --data d")
        self.serve("build/release/bin/lightmill-worker --coordinator 127.0.0.1:7070 --threads 1")

    def run(self, command):
        if change := re.fullmatch(r"cd (\S+)", command):
            self.folder = self.folder / change[1]
            return "ran"
        if not command.startswith("./"):
            self.folder = self.root
        if any(server in command for server in SERVERS):
            self.serve(command)
            return "started"
        self.need_farm(command)
        environment = {**os.environ, "LIGHTMILL_COORDINATOR": self.address or "127.0.0.1:1"}
        done = subprocess.run(self.here(command), shell=True, cwd=self.folder, env=environment, capture_output=True,
                              text=True, timeout=GENEROUS_S, executable="/bin/bash")
        assert done.returncode == 0, f"{self.path.name}: {command}\nexit {done.returncode}: {done.stderr[-1000:]}"
        return "ran"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("pages", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()
    pages = arguments.pages or sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
    counts = {"ran": 0, "started": 0, "elsewhere": 0}
    for path in pages:
        if path.name in PAGES_ELSEWHERE:
            print(f"{path.name}: {PAGES_ELSEWHERE[path.name]}")
            continue
        with Page(path, arguments.bin) as page:
            for command in commands(path):
                reason = next((where for pattern, where in ELSEWHERE if re.search(pattern, command)), None)
                try:
                    outcome = "elsewhere" if reason else page.run(command)
                except Missing as missing:
                    outcome, reason = "elsewhere", f"skipped: {missing}"
                counts[outcome] += 1
                print(f"{path.name}: {outcome}{': ' + reason if reason else ''}: {command}", flush=True)
    assert counts["ran"] > 0 or arguments.pages, "no page has a command"
    print("ok:", ", ".join(f"{count} {outcome}" for outcome, count in counts.items()))


if __name__ == "__main__":
    sys.exit(main())
