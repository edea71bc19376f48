"""One answer: the farm, whoever rendered what and whatever died on the way, gives the pixels of `lightmill render`.

    process_test.py --bin build/release/bin [workers] [restart] [pilot] [strangers] [wire] [moving] [healing]
"""
import argparse
import hashlib
import pathlib
import signal
import sqlite3
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm, assert_same_pixels, pixels, wait_until  # noqa: E402
from paths import ROOT  # noqa: E402

SCENE = ROOT / "scenes" / "cornell-spheres.pbrt"
LONG_SPP = 2048  # enough to be killed in the middle of


def options(spp):
    return [SCENE, "--integrator", "bdpt", "--resolution", "80x48", "--seed", "7", "--spp", str(spp)]


def layered(spp):
    """With everything that can be recorded beside the colours: the layers of the image are compared, too."""
    return [*options(spp), "--aov", "all"]


def test_workers(bin_dir, kill_at):
    """1, 2 and 5 workers of different thread counts; one killed while it holds a lease, one late."""
    with Farm(bin_dir) as farm:
        reference = farm.render("local2.exr", *options(64), "--threads", 2)
        assert_same_pixels(reference, farm.render("local1.exr", *options(64), "--threads", 1))
        assert_same_pixels(reference, farm.render("local5.exr", *options(64), "--threads", 5))
        long_reference = farm.render("long.exr", *layered(LONG_SPP))
        assert pixels(long_reference).shape[-1] == 109, "all AOVs beside R, G and B"
        farm.start_coordinator()

        farm.start_worker(2)
        assert_same_pixels(reference, farm.finish_and_fetch(farm.submit(*options(64)), "one.exr"))

        farm.start_worker(1)
        assert_same_pixels(reference, farm.finish_and_fetch(farm.submit(*options(64)), "two.exr"))

        victim = farm.start_worker(4)
        farm.start_worker(3)
        wait_until("four workers", lambda: len(farm.json("workers")) >= 4)
        job = farm.submit(*layered(LONG_SPP))
        farm.wait_for_packets(job, kill_at)
        held = farm.kill_while_leased(job, victim, 4)
        farm.start_worker(5)  # the late one
        assert_same_pixels(long_reference, farm.finish_and_fetch(job, "five.exr"))
        ledger = {t["id"]: t for t in farm.json("tiles", job)}
        assert all(t["state"] == "committed" for t in ledger.values())
        assert any(ledger[t["id"]]["attempt"] > 1 for t in held if t["id"] in ledger) or any(
            t["attempt"] > 1 for t in ledger.values()), "the kill hit no lease"
        assert farm.json("job", job)["leases_reassigned"] >= 1


def test_restart(bin_dir, kill_at):
    """32 spp extended to 64 are 64 spp; a coordinator killed in mid-job and restarted goes on."""
    with Farm(bin_dir) as farm:
        reference = farm.render("local.exr", *layered(64))
        short_reference = farm.render("short.exr", *layered(32))
        long_reference = farm.render("long.exr", *layered(LONG_SPP))
        assert pixels(long_reference).shape[-1] == 109, "all AOVs beside R, G and B"
        farm.start_coordinator()
        farm.start_worker(2)
        job = farm.submit(*layered(32))
        assert_same_pixels(short_reference, farm.finish_and_fetch(job, "thirtytwo.exr"))
        farm.lightmill("extend", job, "--spp", 64)
        assert_same_pixels(reference, farm.finish_and_fetch(job, "extended.exr"))

        long_job = farm.submit(*layered(LONG_SPP))
        farm.wait_for_packets(long_job, kill_at)
        farm.kill_coordinator()
        # Who asks before it is back waits for it.
        early = farm.start_watch(long_job)
        farm.start_coordinator()
        after = farm.json("job", long_job)
        assert after["packets_done"] >= kill_at, f"acknowledged packets are gone: {after}"
        assert_same_pixels(long_reference, farm.finish_and_fetch(long_job, "restarted.exr"))
        assert_same_pixels(reference, farm.folder / "extended.exr")
        assert early.wait(GENEROUS_S) == 0, "a watch that began before the coordinator did"


def test_pilot(bin_dir, kill_at):
    """auto: a worker and the coordinator die while the plan is being chosen, and nobody can tell from the image."""
    del kill_at  # nothing is merged yet
    scene = [SCENE, "--resolution", "80x48", "--seed", "7"]
    with Farm(bin_dir) as farm:
        short_reference = farm.render("local32.exr", *scene, "--spp", 32, "--threads", 1)
        reference = farm.render("local64.exr", *scene, "--spp", 64, "--threads", 3)
        farm.start_coordinator()
        while True:  # until the victim dies with the pilot in its hands, not with a tile
            victim = farm.start_worker(4)
            wait_until("the victim", lambda: any(w["state"] == "idle" for w in farm.json("workers")))
            job = farm.submit(*scene, "--spp", 32)
            if farm.kill_while_leased(job, victim, 4)[0]["pilot"]:
                break
            farm.lightmill("cancel", job)
        farm.kill_coordinator()
        farm.start_coordinator()
        status = farm.json("job", job)
        assert status["pilot"] is None and status["settings"]["plan"] is None, status
        farm.start_worker(2)
        farm.start_worker(1)
        assert_same_pixels(short_reference, farm.finish_and_fetch(job, "thirtytwo.exr"))
        ledger = farm.json("tiles", job)
        assert [t["pilot"] for t in ledger].index(True) == 0 and sum(t["pilot"] for t in ledger) == 1, ledger
        assert ledger[0]["attempt"] >= 2, "the kill did not hit the pilot"

        status = farm.json("job", job)
        assert status["settings"]["plan"] == status["pilot"]["chosen"], status
        farm.kill_coordinator()
        farm.start_coordinator()
        assert farm.json("job", job)["pilot"] == status["pilot"], "an acknowledged pilot is gone"
        farm.lightmill("extend", job, "--spp", 64)
        assert_same_pixels(reference, farm.finish_and_fetch(job, "extended.exr"))
        fresh = farm.submit(*scene, "--spp", 64)
        assert_same_pixels(reference, farm.finish_and_fetch(fresh, "fresh.exr"))
        repeated = farm.submit(*scene, "--spp", 64, "--plan", farm.folder / "extended.exr")
        assert_same_pixels(reference, farm.finish_and_fetch(repeated, "repeated.exr"))
        assert not any(t["pilot"] for t in farm.json("tiles", repeated)), "with a plan no pilot runs"


def test_strangers(bin_dir, kill_at):
    """A worker of another build is refused; one of another arithmetic class gets other jobs; SIGTERM drains."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        stranger = farm.start_worker(1, LIGHTMILL_TEST_BUILD_ID="lightmill of another age")
        assert stranger.wait(timeout=60) == 3, "a worker of another build must exit with 3"
        sentence = farm.logs[-1].read_text().splitlines()[-1]
        assert "lightmill of another age" in sentence, sentence
        job = farm.submit(*options(LONG_SPP))
        said = farm.json("job", job)["message"]
        assert "none is connected" in said and 'it is "lightmill of another age"' in said, said
        assert said in farm.lightmill("job", job), "users of the terminal see it, too"

        ours = farm.start_worker(2)
        farm.wait_for_packets(job, 1)
        other = farm.start_worker(3, LIGHTMILL_TEST_ARITHMETIC_CLASS="0" * 64)
        other_id = wait_until("the other class", lambda: next(
            (w["id"] for w in farm.json("workers") if w["arithmetic_class"] == "0" * 64), None))
        reference = farm.render("long.exr", *options(LONG_SPP))
        assert_same_pixels(reference, farm.finish_and_fetch(job, "mine.exr"))
        assert other.poll() is None
        tiles = farm.json("tiles", job)
        assert tiles and all(t["worker"] != other_id for t in tiles), "a job must stay within one class"

        ours.send_signal(signal.SIGTERM)
        assert ours.wait(timeout=60) == 0, "SIGTERM must drain"
        second = farm.submit(*options(16))
        farm.finish_and_fetch(second, "theirs.exr")
        assert {t["worker"] for t in farm.json("tiles", second)} == {other_id}


def test_wire(bin_dir, _):
    """Splats over a window that is large enough to be spared: few bytes, and the same pixels after a kill."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        victim = farm.start_worker(1)
        farm.start_worker(1)
        wait_until("two workers", lambda: len(farm.json("workers")) >= 2)
        wide = [SCENE, "--integrator", "bdpt", "--resolution", "512x512", "--seed", "3", "--spp", "16"]
        job = farm.submit(*wide)
        assert_same_pixels(farm.render("wide.exr", *wide), farm.finish_and_fetch(job, "two.exr"))
        status = farm.json("job", job)
        assert status["commit_bytes"] <= 28e6, f"{status['commit_bytes']} bytes in {status['tiles_committed']} tiles"

        small = [SCENE, "--integrator", "bdpt", "--resolution", "192x128", "--seed", "3"]
        reference = farm.render("small.exr", *small, "--spp", "96")
        job = farm.submit(*small, "--spp", "48")
        wait_until("a first round", lambda: farm.json("job", job)["packets_done"] >= 24)
        victim.kill()  # in the middle of a tile, or just after one
        farm.start_worker(2)
        wait_until("the end", lambda: farm.json("job", job)["state"] == "done")
        farm.lightmill("extend", job, "--spp", 96)
        assert_same_pixels(reference, farm.finish_and_fetch(job, "extended.exr"))


def test_moving(bin_dir, _):
    """A scene in which shapes, instances and the camera move, to all three integrators."""
    with Farm(bin_dir) as farm:
        farm.start_coordinator()
        farm.start_worker(1)
        farm.start_worker(2)
        wait_until("two workers", lambda: len(farm.json("workers")) >= 2)
        for integrator in ("pt", "bdpt", "lt"):
            moving = [ROOT / "scenes" / "motion-blur.pbrt", "--integrator", integrator, "--resolution", "80x60",
                      "--seed", "7", "--spp", "64"]
            reference = farm.render(f"{integrator}.exr", *moving)
            assert_same_pixels(reference, farm.finish_and_fetch(farm.submit(*moving), f"farm-{integrator}.exr"))


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def damage(path):
    """Flips a byte in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


def two_files(folder):
    """The scene in two files, as a bundle has them."""
    head, world = SCENE.read_text().split("WorldBegin\n")
    parts = [folder / "main.pbrt", folder / "world.pbrt"]
    parts[0].write_text(head + 'WorldBegin\nInclude "world.pbrt"\n')
    parts[1].write_text(world)
    return parts


def test_healing(bin_dir, kill_at):
    """Scene files that the disk loses or damages come back from a worker or a client, a damaged film by rendering."""
    with Farm(bin_dir) as farm:
        scene = two_files(farm.folder)
        long_job = [scene[0], *options(LONG_SPP)[1:]]
        short_job = [scene[0], *options(16)[1:]]
        long_reference = farm.render("long.exr", *long_job)
        short_reference = farm.render("short.exr", *short_job)
        farm.start_coordinator()
        blobs = [farm.folder / "data" / "blobs" / sha256(file) for file in scene]

        def all_are_right():
            return all(blob.exists() and sha256(blob) == blob.name for blob in blobs)

        # A worker has the files, a second one comes when the coordinator has lost one and damaged the other.
        owner = farm.start_worker(2)
        job = farm.submit(*long_job)
        farm.wait_for_packets(job, kill_at)
        farm.lightmill("pause", job)
        assert all_are_right()
        owner.send_signal(signal.SIGSTOP)
        blobs[0].unlink()
        damage(blobs[1])
        farm.start_worker(1)
        farm.lightmill("resume", job)
        status = wait_until("the job to say what is lost", lambda: (
            s := farm.json("job", job))["state"] == "paused" and "lost on the coordinator" in s["message"] and s)
        assert "main.pbrt" in status["message"] and "submit the scene again" in status["message"], status
        owner.send_signal(signal.SIGCONT)
        assert_same_pixels(long_reference, farm.finish_and_fetch(job, "handed-in.exr"))
        wait_until("both files", all_are_right)
        assert len({t["worker"] for t in farm.json("tiles", job)}) == 2, "the second worker has rendered nothing"
        assert (blobs[1].parent / f"damaged-{blobs[1].name}").exists(), "what was damaged is kept, to be looked at"

        # Nobody needs them now; whoever submits the scene again brings them.
        blobs[1].unlink()
        damage(blobs[0])
        second = farm.submit(*short_job)
        assert all_are_right(), "a submission mends at once"
        assert_same_pixels(short_reference, farm.finish_and_fetch(second, "again.exr"))

        farm.kill_coordinator()
        damage(blobs[0])
        with sqlite3.connect(farm.folder / "data" / "jobs.sqlite") as store:
            store.execute("UPDATE layers SET bytes = substr(bytes, 1, 99) || x'DEADBEEF' || substr(bytes, 104) "
                          "WHERE job = ? AND kind = 'film' AND part = 0", [second])
        store.close()
        check = subprocess.run([farm.bin / "lightmill-coordinator", "--check", "--data", farm.folder / "data"],
                               capture_output=True, text=True, timeout=GENEROUS_S)
        assert check.returncode == 1, check
        lines = check.stderr.splitlines()
        assert len(lines) == 2 and any(f"{blobs[0]}: damaged" in line for line in lines), lines
        assert any(f"job {second}" in line or "film" in line for line in lines), lines
        farm.start_coordinator()
        farm.lightmill("fetch", second, "-o", farm.folder / "damaged.exr", expect=1)
        farm.lightmill("retry", second)
        assert_same_pixels(short_reference, farm.finish_and_fetch(second, "rendered-again.exr"))


def main():
    tests = {"workers": test_workers, "restart": test_restart, "pilot": test_pilot, "strangers": test_strangers,
             "wire": test_wire, "moving": test_moving, "healing": test_healing}
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--kill-at", type=int, default=60, help="packets merged before something is killed")
    parser.add_argument("parts", nargs="*", choices=[[], *tests], help="default: all")
    arguments = parser.parse_args()
    for name in arguments.parts or tests:
        start = time.monotonic()
        tests[name](arguments.bin, arguments.kill_at)
        print(f"ok {name} ({time.monotonic() - start:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
