"""The commands of docs/security.md, run as they stand: security_doc_test.py --bin build/release/bin"""
import argparse
import os
import pathlib
import re
import subprocess
import tempfile
import time

from paths import ROOT

GENEROUS_S = 120


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    bin_dir = pathlib.Path(parser.parse_args().bin).resolve()
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "docs" / "security.md").read_text(), re.S)
    assert len(blocks) == 3, f"{len(blocks)} blocks"
    setting_up, using, rotating = ([line for line in block.splitlines() if line] for block in blocks)
    with tempfile.TemporaryDirectory(prefix="lightmill-doc-") as folder:
        environment = {k: v for k, v in os.environ.items() if not k.startswith("LIGHTMILL_")}
        environment["PATH"] = f"{bin_dir}:{environment['PATH']}"

        def shell(line, expect=0):
            done = subprocess.run(["bash", "-c", line], cwd=folder, env=environment, capture_output=True, text=True,
                                  timeout=GENEROUS_S)
            assert done.returncode == expect, f"{line}: exit {done.returncode}: {done.stderr[-500:]}"
            return done.stdout

        for line in setting_up:
            out = shell(line)
            if line.startswith("ls"):
                assert out.split() == line.split("#")[1].split(), out
        log = open(pathlib.Path(folder) / "log", "wb")
        coordinator = subprocess.Popen(["bash", "-c", f"exec {using[0]}"], cwd=folder, env=environment, stdout=log, stderr=log)
        try:
            ports = pathlib.Path(folder) / "ports"
            end = time.monotonic() + GENEROUS_S
            while not ports.exists():
                assert coordinator.poll() is None and time.monotonic() < end
                time.sleep(0.05)
            number = dict(line.split("=") for line in ports.read_text().split())

            def use(line, **more):
                return shell(line.replace("RPC", number["rpc"]).replace("HTTP", number["http"]), **more)

            jobs, metrics = using[1], using[2]
            assert "STATE" in use(jobs)
            assert "lightmill_jobs" in use(metrics.replace("curl", "curl -fsS"))
            old = (pathlib.Path(folder) / "farm-credentials/ann/token").read_text()
            shell(rotating[0])
            assert (pathlib.Path(folder) / "farm-credentials/ann/token").read_text() != old
            use(jobs)
            shell(rotating[1])
            use(jobs)
            time.sleep(2.5)  # by now the coordinator shows its new certificate
            use(jobs)
            (pathlib.Path(folder) / "kept").mkdir()
            shell("cp farm-credentials/ann/* kept/")
            shell(rotating[2])
            use(jobs.replace("farm-credentials/ann", "kept"), expect=3)
            use(jobs, expect=2)
        finally:
            coordinator.terminate()
            coordinator.wait()
            log.close()
    print("ok")


if __name__ == "__main__":
    main()
