"""The Python package of client/python on a real farm: what it fetches has the bits of the command line's, it goes on when
the coordinator dies and comes back, TLS and roles, and the examples of docs/http-api.md.

    python_client_test.py --bin build/release/bin
"""
import argparse
import asyncio
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm, pixels, wait_until  # noqa: E402
from paths import ROOM, ROOT  # noqa: E402
import numpy  # noqa: E402

sys.path.insert(0, str(ROOT / "client" / "python"))
import lightmill  # noqa: E402

GONE = "http://127.0.0.1:1"
SIZE = (64, 48)
PT = {"spp": 32, "integrator": "pt", "seed": 5}
PT_OPTIONS = ["--spp", 32, "--integrator", "pt", "--seed", 5]


def raises(kind, call, text=""):
    try:
        call()
    except kind as error:
        assert text in str(error) and "\n" not in str(error), f"{error}"
        return error
    raise AssertionError(f"no {kind.__name__}")


def run(*command, **options):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=GENEROUS_S, **options)


def the_example(farm):
    """client/python/render.py: with several coordinators, and when its own dies."""
    program = ROOT / "client" / "python" / "render.py"
    gone = run("/usr/bin/python3", program, ROOM, "--coordinator", GONE, "-o", "x.exr")
    assert gone.returncode == 1 and f"{GONE} can't be reached" in gone.stderr and "Traceback" not in gone.stderr, gone.stderr
    output = farm.folder / "python.exr"
    everybody = f"{GONE},http://{farm.http}"
    done = run("/usr/bin/python3", program, ROOM, "--coordinator", everybody, "--size", "64x48", *PT_OPTIONS, "-o", output)
    assert done.returncode == 0, done.stderr
    job = done.stdout.strip()
    assert farm.json("job", job)["state"] == "done"
    assert f"{job} done" in done.stderr, done.stderr
    reference = farm.render("cli.exr", ROOM, "--resolution", "64x48", *PT_OPTIONS)
    assert numpy.array_equal(pixels(output), pixels(reference)), "the clients' pictures differ"

    long = ["--spp", 2048, "--integrator", "bdpt", "--seed", 6]
    watching = subprocess.Popen(["/usr/bin/python3", program, ROOM, "--coordinator", everybody, "--size", "64x48",
                                 *map(str, long), "-o", output], stdout=subprocess.PIPE, text=True)
    job = watching.stdout.readline().strip()
    farm.wait_for_packets(job, 10)
    farm.kill_coordinator()
    farm.start_coordinator()
    assert watching.wait(timeout=GENEROUS_S) == 0, "a client that watches goes back to whoever leads"
    reference = farm.render("long.exr", ROOM, "--resolution", "64x48", *long)
    assert numpy.array_equal(pixels(output), pixels(reference)), "the clients' pictures differ"


def the_package(farm):
    client = lightmill.Farm(f"http://{farm.http}")
    job = client.submit(ROOM, resolution=SIZE, aovs="albedo,depth", name="from Python", priority=3, **PT)
    assert job.wait().spp == 32
    reference = farm.render("cli.exr", ROOM, "--resolution", "64x48", *PT_OPTIONS, "--aov", "albedo,depth")
    wanted = pixels(reference)
    image = job.image()
    assert image.dtype == numpy.float32 and image.shape == (48, 64, 3)
    assert image.tobytes() == numpy.ascontiguousarray(wanted[:, :, :3]).tobytes(), "the bits differ"
    layers = job.image(aovs=True)
    assert layers["rgb"].tobytes() == image.tobytes()
    assert layers["albedo"].shape == (48, 64, 3) and layers["depth"].shape == (48, 64, 1), {k: v.shape for k, v in layers.items()}
    assert job.image(max_side=32).shape == (24, 32, 3)
    assert bytes(job.picture().data) == image.tobytes()
    for name in ("x.exr", "x.png", "x.raw"):
        job.save(farm.folder / name)
    assert numpy.array_equal(pixels(farm.folder / "x.exr"), wanted[:, :, :3])
    job.save(farm.folder / "layers.exr", aovs=True)
    assert numpy.array_equal(pixels(farm.folder / "layers.exr"), wanted), "layers and all"

    status = job.status()
    assert (status.name, status.priority, status.state) == ("from Python", 3, lightmill.JobState.DONE)
    assert status.packets_done == status.packets_total > 0
    assert job.curve().points[-1].spp == 32
    assert sum(tile.state is lightmill.TileState.COMMITTED for tile in job.tiles()) == status.tiles_committed
    assert any("committed" in line.text for line in job.logs(lines=50))
    assert [w.state for w in client.workers()] and job.id in [j.id for j in client.jobs()]

    # Control, and what is not allowed.
    raises(lightmill.FailedPrecondition, job.pause)
    longer = client.submit(ROOM, spp=100000, integrator="pt", resolution=(256, 256))
    raises(lightmill.WaitTimeout, lambda: longer.wait(0.5), longer.id)
    assert longer.pause().state is lightmill.JobState.PAUSED
    assert longer.resume().state in (lightmill.JobState.QUEUED, lightmill.JobState.RUNNING)
    assert longer.cancel().state is lightmill.JobState.CANCELLED
    assert raises(lightmill.JobFailed, longer.wait, "cancelled").status.state is lightmill.JobState.CANCELLED
    assert not longer.retry().state.final
    longer.cancel()
    assert job.extend(spp=64).state is not lightmill.JobState.DONE
    assert job.wait().spp == 64
    raises(lightmill.InvalidArgument, lambda: job.extend(spp=1))
    raises(lightmill.NotFound, client.job("j404").status, "j404")
    raises(lightmill.NotFound, lambda: list(client.job("j404").watch()))
    raises(lightmill.NotFound, client.job("j404").image)


def scenes(farm):
    """Files beside the scene, above it, with backslashes, in memory, large, and missing."""
    client = lightmill.Farm(f"http://{farm.http}")
    folder = farm.folder / "scene"
    (folder / "parts").mkdir(parents=True)
    (folder / "main.pbrt").write_text('Film "rgb" "integer xresolution" 40 "integer yresolution" 30\n'
                                      'Sampler "sobol" "integer pixelsamples" 4\nIntegrator "path" "integer maxdepth" 2\n'
                                      'WorldBegin\nLightSource "infinite"\nInclude "parts\\\\ball.pbrt"\n'
                                      'Include "../above.pbrt"\n')
    (folder / "parts" / "ball.pbrt").write_text('Material "diffuse"\nTranslate 0 0 5\nShape "sphere"\n')
    (farm.folder / "above.pbrt").write_text("# " + "x" * (3 << 20) + '\nShape "sphere" "float radius" 0.5\n')
    sent = []
    job = client.submit(folder / "main.pbrt", integrator="pt", progress=lambda done, total: sent.append((done, total)))
    status = job.wait()
    assert (status.name, status.spp) == ("main", 4), "as the scene says"
    assert job.image().shape == (30, 40, 3)
    assert sent and sent[-1][0] == sent[-1][1] > 3 << 20 and len(sent) > 4, sent
    sent.clear()
    again = client.submit(folder / "main.pbrt", integrator="pt", spp=8, progress=lambda *x: sent.append(x))
    assert not sent, "what the farm has is not sent again"
    assert again.status().bundle_digest == status.bundle_digest
    # The same from memory, as a program makes it that has no files.
    files = {"main.pbrt": (folder / "main.pbrt").read_bytes().replace(b"../above.pbrt", b"in/memory.pbrt"),
             "parts/ball.pbrt": folder / "parts" / "ball.pbrt", "in/memory.pbrt": b'Shape "sphere" "float radius" 0.5\n'}
    files["main.pbrt"] = files["main.pbrt"].replace(b"parts\\\\ball.pbrt", b"parts/ball.pbrt")
    made = client.submit("main.pbrt", files=files, integrator="pt")
    made.wait()
    assert made.image().tobytes() == job.image().tobytes()

    check = client.check(folder / "main.pbrt")
    assert not check.errors and (check.width, check.height, check.spp, check.files) == (40, 30, 4, 3), check
    (folder / "parts" / "ball.pbrt").unlink()
    raises(lightmill.InvalidArgument, lambda: client.submit(folder / "main.pbrt"), "main.pbrt:6:")
    (folder / "empty.pbrt").write_bytes(b"")
    for options in ({"spp": 0}, {"integrator": "magic"}, {"resolution": (0, 5)}, {"crop": (0.5, 0.5, 0, 1)},
                    {"time": float("nan")}, {"aovs": "beauty"}, {"seed": -1}, {"crop": (0, 1)}):
        raises(lightmill.InvalidArgument, lambda options=options: client.submit(ROOM, **options))
    raises(lightmill.LightmillError, lambda: client.submit(ROOM, after=["j404"]))
    raises(lightmill.InvalidArgument, lambda: client.submit(farm.folder / "none.pbrt"), "none.pbrt")

    # A ready bundle.
    bundle = {"version": 1, "main": "room.pbrt", "entries": [client_entry(ROOM)]}
    seen = client.check(ROOM, spp=5, integrator="pt", resolution=SIZE)
    alike = client.submit_bundle(json.loads(seen.bundle_json), {**json.loads(seen.settings_json), "seed": 7})
    assert alike.wait().spp == 5 and json.loads(alike.status().settings_json)["seed"] == 7
    ready = client.submit_bundle(bundle, json.loads(job.status().settings_json), [ROOM], name="ready")
    assert ready.wait().name == "ready"


def client_entry(path):
    content = path.read_bytes()
    return {"name": path.name, "digest": hashlib.sha256(content).hexdigest(), "size": len(content)}


def sequences(farm):
    """Frames of an animation as one thing, from submission to files."""
    client = lightmill.Farm(f"http://{farm.http}")
    scene, small = ROOT / "scenes" / "windmill.gltf", {"spp": 8, "integrator": "pt", "resolution": (48, 32), "seed": 2}
    shot = client.submit(scene, frames="0-4x2", fps=8, order="coarse-first", name="shot", **small)
    assert isinstance(shot, lightmill.Sequence)
    last = shot.wait()
    assert (last.state, last.frame_count, last.frames.done, last.fps) == (lightmill.JobState.DONE, 3, 3, 8.0), last
    frames = list(shot.frames())
    assert [(f.number, f.spp) for f in frames] == [(0, 8), (2, 8), (4, 8)], frames
    assert not list(shot.frames(since=max(f.version for f in frames)))
    names = shot.save(farm.folder / "shot.###.exr")
    assert names == [str(farm.folder / f"shot.{n:03d}.exr") for n in (0, 2, 4)], names
    alone = client.submit(scene, time_of=0.25, **small)
    alone.wait()
    assert alone.image().tobytes() == shot.frame(2).image().tobytes()
    assert numpy.array_equal(pixels(farm.folder / "shot.002.exr"), alone.image())
    raises(lightmill.FailedPrecondition, shot.pause, "no frame of sequence")
    assert shot.extend(spp=16).state is not lightmill.JobState.DONE
    assert shot.wait().state is lightmill.JobState.DONE and next(shot.frames()).spp == 16
    assert shot.id in [s.id for s in client.sequences()]
    jobs = [job.id for job in client.jobs()]
    assert alone.id in jobs and f"{shot.id}.2" not in jobs
    assert f"{shot.id}.2" in [job.id for job in client.jobs(frames=True)]
    endless = client.submit(scene, frames=[1, 2], spp=1 << 30, integrator="pt", resolution=(48, 32))
    assert endless.set_priority(2).priority == 2
    assert endless.cancel().state is lightmill.JobState.CANCELLED
    assert raises(lightmill.SequenceFailed, endless.wait).status.frames.cancelled == 2
    raises(lightmill.NotFound, client.sequence("s404").status, "s404")
    for bad in ("", "5-1", "1-99999", "x"):
        raises(lightmill.InvalidArgument, lambda bad=bad: client.submit(scene, frames=bad))
    raises(lightmill.InvalidArgument, lambda: client.submit(ROOM, frames="1-2"), "glTF")
    raises(lightmill.InvalidArgument, lambda: shot.save("one.exr"), "shot.%04d.exr")

    async def main():
        async with lightmill.AsyncFarm(f"http://{farm.http}") as other:
            made = await other.submit_frames(scene, "1-2", **small)
            assert (await made.wait()).frames.done == 2
            assert [f.number async for f in made.frames()] == [1, 2]

    asyncio.run(main())


def asynchronously(farm):
    async def main():
        async with lightmill.AsyncFarm(f"http://{farm.http}") as client:
            jobs = await asyncio.gather(*(client.submit(ROOM, spp=4, seed=i, integrator="pt", resolution=SIZE)
                                          for i in range(3)))
            last = await asyncio.gather(*(job.wait() for job in jobs))
            assert all(s.state is lightmill.JobState.DONE for s in last)
            assert (await jobs[0].image()).shape == (48, 64, 3)
            endless = await client.submit(ROOM, spp=1 << 30, integrator="pt", resolution=SIZE)
            task = asyncio.create_task(endless.wait())
            async for status in endless.watch():
                if status.state is lightmill.JobState.RUNNING:
                    break
            task.cancel()
            try:
                await task
                raise AssertionError("it was cancelled")
            except asyncio.CancelledError:
                pass
            assert (await endless.cancel()).state is lightmill.JobState.CANCELLED
            assert endless.id in [j.id async for j in client.jobs()]

    asyncio.run(main())


def a_restart(farm):
    """A watch in this process lives through the coordinator's death."""
    client = lightmill.Farm([GONE, f"http://{farm.http}"], reconnect_seconds=GENEROUS_S)
    job = client.submit(ROOM, spp=1 << 30, integrator="pt", resolution=SIZE)
    seen, ended = [], []

    def watch():
        for status in job.watch():
            seen.append(status.state)
        ended.append(True)

    watcher = threading.Thread(target=watch)
    watcher.start()
    wait_until("the first state", lambda: seen)
    farm.kill_coordinator()
    farm.start_coordinator()
    wait_until("the coordinator", lambda: not job.status().state.final)
    job.cancel()
    watcher.join(GENEROUS_S)
    assert ended and seen[-1] is lightmill.JobState.CANCELLED, seen


def tls(farm):
    """A farm with certificates and tokens."""
    credentials = farm.folder / "credentials"
    for command in (["init", "--dir", credentials], ["grant", "ann", "--role", "submitter", "--dir", credentials],
                    ["grant", "obi", "--role", "observer", "--dir", credentials]):
        made = run(farm.bin / "lightmill-coordinator", *command)
        assert made.returncode == 0, made.stderr
    port_file = farm.folder / "tls-port"
    server = farm._start("tls", ["lightmill-coordinator", "--credentials", credentials / "coordinator", "--listen",
                                 "127.0.0.1:0", "--http", "127.0.0.1:0", "--data", farm.folder / "tls-data",
                                 "--port-file", port_file])
    try:
        wait_until("the port", lambda: port_file.exists() and "http=" in port_file.read_text())
        port = dict(line.split("=") for line in port_file.read_text().split())["http"]
        url = f"https://localhost:{port}"
        ann = lightmill.Farm(url, credentials=credentials / "ann")
        job = ann.submit(ROOM, spp=4, integrator="pt")
        assert job.status().submitter == "ann"
        obi = lightmill.Farm(url, ca=credentials / "obi" / "ca.crt", token=(credentials / "obi" / "token").read_text())
        assert [j.id for j in obi.jobs()] == [job.id]
        raises(lightmill.PermissionDenied, obi.job(job.id).cancel, "submitter or admin")
        raises(lightmill.PermissionDenied, lambda: obi.submit(ROOM, spp=4))
        raises(lightmill.Unauthenticated, lightmill.Farm(url, ca=credentials / "ann" / "ca.crt").job(job.id).status)
        raises(lightmill.Unauthenticated,
               lightmill.Farm(url, ca=credentials / "ann" / "ca.crt", token="nothing").job(job.id).status)
        raises(lightmill.Unreachable, lightmill.Farm(url, token="x").job(job.id).status, "certificate is not trusted")
        raises(lightmill.Unreachable, lightmill.Farm(f"http://localhost:{port}").job(job.id).status)
    finally:
        server.kill()
        server.wait()


def documentation(farm):
    """The examples in Python of docs/http-api.md."""
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / "http-api.md").read_text(), re.M | re.S)
    assert len(blocks) == 2
    scene = farm.folder / "scenes" / "cornell-spheres.pbrt"
    scene.parent.mkdir()
    text = (ROOT / "scenes" / "cornell-spheres.pbrt").read_text()
    scene.write_text(re.sub(r'("integer [xy]resolution") \d+', r"\1 24", text))
    for block in blocks:
        done = run("/usr/bin/python3", "-W", "error", "-c", block.replace("127.0.0.1:8080", farm.http), cwd=farm.folder,
                   env={**os.environ, "PYTHONPATH": str(ROOT / "client" / "python")})
        assert done.returncode == 0, done.stderr
    assert (farm.folder / "spheres.exr").exists() and (farm.folder / "async.exr").exists()


def types(farm):
    """mypy, and an installation by pip, where there are these."""
    package = farm.folder / "package"
    shutil.copytree(ROOT / "client" / "python", package, ignore=shutil.ignore_patterns("*cache*", "build", "*.egg-info"))
    if shutil.which("mypy"):
        for what in (["-p", "lightmill"], ["render.py"]):
            done = run("mypy", "--strict", "--cache-dir", farm.folder / "mypy", *what, cwd=package)
            assert done.returncode == 0, done.stdout
    else:
        print("skipped: mypy is not installed")
    if run("/usr/bin/python3", "-m", "pip", "--version").returncode == 0:
        done = run("/usr/bin/python3", "-m", "pip", "install", "--no-index", "--target", farm.folder / "installed", package)
        assert done.returncode == 0, done.stderr
        assert (farm.folder / "installed" / "lightmill" / "py.typed").exists()
    else:
        print("skipped: pip is not installed")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Farm(arguments.bin) as farm:
        types(farm)
        farm.start_coordinator()
        farm.start_worker(2)
        for part in (the_package, scenes, sequences, asynchronously, documentation, the_example, a_restart, tls):
            part(farm)
            print(f"{part.__name__}: ok", flush=True)


if __name__ == "__main__":
    main()
