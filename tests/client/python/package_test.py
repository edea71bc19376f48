"""The Python package by itself: values, paths, pictures, and coordinators that are away, stand by or talk nonsense.

    package_test.py
"""
import asyncio
import contextlib
import dataclasses
import http.server
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "client" / "python"))
import lightmill  # noqa: E402
from lightmill import errors, farm as farm_module, model, picture, scenes, transport  # noqa: E402

GENEROUS_S = 60


class Coordinator:
    """An HTTP server whose answers are given in turn: (status, body), the last one again and again. A body of None cuts
    the connection; a list is sent in pieces, and None in it cuts."""

    def __init__(self, *answers):
        self.answers, self.seen = list(answers), []
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                outer.seen.append((self.command, self.path, dict(self.headers), body))
                status, answer = outer.answers.pop(0) if len(outer.answers) > 1 else outer.answers[0]
                if answer is None:
                    self.close_connection = True
                    return
                self.send_response(status)
                if isinstance(answer, list):
                    self.send_header("Transfer-Encoding", "chunked")
                    self.end_headers()
                    for part in [*answer, b""]:
                        if part is None:
                            self.connection.shutdown(2)
                            return
                        self.wfile.write(b"%x\r\n%s\r\n" % (len(part), part))
                        self.wfile.flush()
                    return
                data = answer if isinstance(answer, bytes) else json.dumps(answer).encode()
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)

            do_POST = do_PUT = do_GET

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.01,))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()


STANDBY = (503, {"code": 14, "message": "standby: the coordinator at x leads this farm", "details": []})
GONE = "http://127.0.0.1:1"


def state(name, **fields):
    return json.dumps({"result": {"job": {"id": "j1", "state": f"JOB_STATE_{name}", **fields}}}).encode() + b"\n"


class Values(unittest.TestCase):
    def test_messages_become_dataclasses(self):
        status = model.from_json(model.JobStatus, {
            "id": "j1", "state": "JOB_STATE_RUNNING", "packets_done": "3", "packets_total": "12", "relmse": "NaN",
            "boxes": [{"side": 4, "relmse": 0.5}], "counters": {"nonfinite": "18446744073709551615"},
            "dropped": [{"kind": "DROP_KIND_NOT_FINITE", "count": "2"}], "later": {"field": 1}, "relmse_low": None})
        self.assertIs(status.state, lightmill.JobState.RUNNING)
        self.assertEqual((status.packets_done, status.progress), (3, 0.25))
        self.assertNotEqual(status.relmse, status.relmse)
        self.assertIsNone(status.relmse_low)
        self.assertEqual(status.boxes[0], lightmill.BoxError(side=4, relmse=0.5))
        self.assertEqual(status.counters.nonfinite, 2**64 - 1)
        self.assertIs(status.dropped[0].kind, lightmill.DropKind.NOT_FINITE)
        self.assertIs(model.from_json(model.JobStatus, {"state": "JOB_STATE_ASLEEP"}).state,
                      lightmill.JobState.UNSPECIFIED)
        for wrong in (None, [], "x"):
            with self.assertRaises(ValueError):
                model.from_json(model.JobStatus, wrong)

    def test_every_field_of_the_protocol_is_there(self):
        text = (ROOT / "proto" / "lightmill" / "v1" / "types.proto").read_text()
        for kind in (model.JobStatus, model.TileStatus, model.WorkerStatus, model.WorkerRegistration, model.ErrorPoint,
                     model.BoxError, model.RenderCounters, model.DroppedContributions, model.ErrorCurve):
            body = re.search(rf"^message {kind.__name__} {{\n(.*?)^}}", text, re.M | re.S)[1]
            fields = set(re.findall(r"^  (?:optional |repeated )?\w+ (\w+) = \d+;", body, re.M))
            self.assertEqual(fields, {f.name for f in dataclasses.fields(kind)}, kind.__name__)
        for kind in (model.JobState, model.TileState, model.WorkerState, model.DropKind):
            body = re.search(rf"^enum {kind.__name__} {{\n(.*?)^}}", text, re.M | re.S)[1]
            prefix = re.sub(r"(?<!^)([A-Z])", r"_\1", kind.__name__).upper() + "_"
            names = {n.removeprefix(prefix) for n in re.findall(r"^  (\w+) = \d+;", body, re.M)}
            self.assertEqual(names, set(kind.__members__), kind.__name__)

    def test_what_is_not_given_is_left_out(self):
        request = farm_module.scene_request(spp=None, seed=0, max_depth=0, time=0, strict=False, name="", after=[],
                                            resolution=(4, 3), shutter=(0, 0.5), crop=(0, 1, 0, 0.5), uniform_sampling=True)
        self.assertEqual(request, {"seed": 0, "max_depth": 0, "time_seconds": 0, "width": 4, "height": 3,
                                   "shutter_opens": 0, "shutter_closes": 0.5, "uniform_sampling": True,
                                   "crop": {"x0": 0, "x1": 1, "y0": 0, "y1": 0.5}})
        for wrong in ({"crop": (0, 1)}, {"resolution": (1, 2, 3)}, {"shutter": (1,)}):
            with self.assertRaises(lightmill.InvalidArgument):
                farm_module.scene_request(**wrong)

    def test_versions_agree(self):
        version = re.search(r"^project\(lightmill VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
        project = (ROOT / "client" / "python" / "pyproject.toml").read_text()
        self.assertEqual(lightmill.__version__, version)
        self.assertIn(f'version = "{version}"', project)

    def test_a_wheel_is_the_whole_package(self):
        with tempfile.TemporaryDirectory() as folder:
            made = subprocess.run([sys.executable, "-c", "import sys, make_wheel; print(make_wheel.build_wheel(sys.argv[1]))",
                                   folder], cwd=ROOT / "client" / "python", capture_output=True, text=True, timeout=GENEROUS_S)
            self.assertEqual(made.returncode, 0, made.stderr)
            wheel = pathlib.Path(folder) / made.stdout.strip()
            with zipfile.ZipFile(wheel) as archive:
                names = set(archive.namelist())
                record = archive.read(next(n for n in names if n.endswith("/RECORD"))).decode()
            self.assertEqual({line.split(",")[0] for line in record.split()}, names)
            self.assertLessEqual({"lightmill/__init__.py", "lightmill/py.typed"}, names)
            self.assertEqual(len([n for n in names if n.startswith("lightmill/")]),
                             len([*(ROOT / "client" / "python" / "lightmill").glob("*.py")]) + 1)
            used = subprocess.run([sys.executable, "-c", "import lightmill; print(lightmill.__file__)"], cwd=folder,
                                  env={**os.environ, "PYTHONPATH": str(wheel)}, capture_output=True, text=True,
                                  timeout=GENEROUS_S)
            self.assertIn(wheel.name, used.stdout, used.stderr)

    def test_pictures(self):
        names = b"R\nG\nB\ndepth.Z"
        raw = b"LMF2" + struct.pack("<4I", 2, 1, 4, len(names)) + names + struct.pack("<8f", *range(8))
        read = picture.picture_of(raw)
        self.assertEqual((read.width, read.height, read.channels), (2, 1, ("R", "G", "B", "depth.Z")))
        self.assertEqual(list(read.floats()), list(range(8)))
        for bad in (b"", b"LMF2", raw[:-1], raw + b"x", b"LMF1" + raw[4:], raw[:20]):
            with self.assertRaises(lightmill.ServerError):
                picture.picture_of(bad)

    def test_paths_of_scenes(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "textures").mkdir()
            (folder / "textures" / "wood.png").write_bytes(b"x")
            for reference in ("textures/wood.png", "textures\\wood.png", "./textures/wood.png",
                              str(folder / "textures" / "wood.png")):
                self.assertIsNotNone(scenes.local_path(folder, reference), reference)
            for reference in ("textures", "wood.png", "C:\\textures\\wood.png", "a\0b", "x" * 5000, ""):
                self.assertIsNone(scenes.local_path(folder, reference), reference)
            with self.assertRaisesRegex(lightmill.InvalidArgument, "no such scene file"):
                scenes.SceneFiles(folder / "none.pbrt")
            given = scenes.SceneFiles("a.pbrt", {"a.pbrt": b"abc", "wood.png": folder / "textures" / "wood.png"})
            self.assertEqual([(e["name"], e["size"]) for e in given.entries()], [("a.pbrt", "3"), ("wood.png", "1")])

    def test_addresses_and_tokens(self):
        self.assertEqual(str(transport.Address("localhost", False)), "http://localhost:7071")
        self.assertEqual(str(transport.Address("farm:80", True)), "https://farm:80")
        self.assertEqual(str(transport.Address("http://[::1]:9/", True)), "http://[::1]:9")
        for bad in ("", "ftp://x", "http://", "http://x:99999", "http://x:y", "http://x/path"):
            with self.assertRaises(lightmill.InvalidArgument, msg=bad):
                transport.Address(bad, False)
        with self.assertRaisesRegex(lightmill.InvalidArgument, "plain text"):
            lightmill.Farm("http://farm.example.org:7071", token="secret")
        for options in ({"token": "a", "token_file": "b"}, {"token": "a\nb"}, {"token": "é"}, {"ca": "/nonexistent"}):
            with self.assertRaises(lightmill.InvalidArgument, msg=options):
                lightmill.Farm("https://localhost:1", **options)
        with self.assertRaises(lightmill.InvalidArgument):
            lightmill.Farm([])
        for job in ("", "../x", ".", "..", "s3.", "s3..1", "j1\n", "j1/image", "j 1", "j1?x"):
            with self.assertRaises(lightmill.InvalidArgument, msg=job):
                lightmill.Farm(GONE).job(job)


class Calls(unittest.TestCase):
    def test_codes_are_exceptions(self):
        for code, kind in ((3, errors.InvalidArgument), (5, errors.NotFound), (7, errors.PermissionDenied),
                           (8, errors.ResourceExhausted), (9, errors.FailedPrecondition), (13, errors.ServerError),
                           (16, errors.Unauthenticated), (999, errors.ServerError), ("x", errors.ServerError)):
            with Coordinator((400, {"code": code, "message": "why not"})) as server:
                with self.assertRaisesRegex(kind, "^why not$"):
                    lightmill.Farm(server.url).job("j1").status()

    def test_a_standby_and_one_that_is_away_are_passed_over(self):
        found = (200, {"job": {"id": "j1", "state": "JOB_STATE_DONE"}})
        with Coordinator(STANDBY) as standby, Coordinator(found) as leader:
            farm = lightmill.Farm(f"{GONE},{standby.url},{leader.url}")
            self.assertIs(farm.job("j1").status().state, lightmill.JobState.DONE)
            farm.job("j1").status()
            self.assertEqual(len(standby.seen), 1, "who leads is remembered")
            with self.assertRaisesRegex(lightmill.Unreachable, "standby"):
                lightmill.Farm([standby.url, GONE]).job("j1").status()
        with self.assertRaisesRegex(lightmill.Unreachable, "can't be reached"):
            lightmill.Farm(GONE).job("j1").status()

    def test_nonsense_is_an_error_of_the_server(self):
        for status, body in ((200, b"<html>"), (500, b"oops\nmore"), (404, b""), (400, [])):
            with Coordinator((status, body)) as server, self.assertRaises(lightmill.LightmillError):
                lightmill.Farm(server.url).job("j1").status()
        with Coordinator((200, [b"x" * 100, None])) as server, self.assertRaises(lightmill.LightmillError):
            lightmill.Farm(server.url).job("j1").file()

    def test_what_changes_something_is_not_sent_twice(self):
        with Coordinator((200, None)) as lost, Coordinator((200, {"job": {"id": "j1"}})) as other:
            with self.assertRaises(lightmill.Unreachable):
                lightmill.Farm([lost.url, other.url]).job("j1").pause()
            self.assertEqual((len(lost.seen), len(other.seen)), (1, 0), "it may have arrived")

    def test_a_kept_connection_that_was_closed_does_no_harm(self):
        found = (200, {"job": {"id": "j1"}})
        with Coordinator(found, (200, None), found) as server:
            job = lightmill.Farm(server.url).job("j1")
            job.status()
            job.status()
            self.assertEqual(len(server.seen), 3)

    def test_tokens_are_read_anew(self):
        with tempfile.TemporaryDirectory() as folder, Coordinator((200, {"job": {}})) as server:
            token = pathlib.Path(folder) / "token"
            token.write_text("first\n")
            job = lightmill.Farm(server.url, token_file=token, ca=None).job("j1")
            job.status()
            token.write_text("second\n")
            job.status()
            self.assertEqual([seen[2]["Authorization"] for seen in server.seen], ["Bearer first", "Bearer second"])
            token.unlink()
            with self.assertRaisesRegex(lightmill.InvalidArgument, "token_file"):
                job.status()

    def test_files_are_saved_whole_or_not_at_all(self):
        with tempfile.TemporaryDirectory() as folder, Coordinator((200, b"picture")) as server:
            job = lightmill.Farm(server.url).job("j1")
            target = pathlib.Path(folder) / "x.PNG"
            job.save(target)
            self.assertEqual(target.read_bytes(), b"picture")
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [target])
            for wrong in ("x.gif", "x"):
                with self.assertRaises(lightmill.InvalidArgument):
                    job.save(pathlib.Path(folder) / wrong)
            with self.assertRaises(OSError):
                job.save(pathlib.Path(folder) / "none" / "x.exr")


class Watching(unittest.TestCase):
    def test_a_stream_that_is_cut_goes_on(self):
        cut = (200, [state("RUNNING"), state("RUNNING")[:20], None])
        ended = (200, [json.dumps({"error": {"code": 14, "message": "shutting down"}}).encode() + b"\n"])
        with Coordinator(cut, STANDBY, ended, (200, [state("PAUSED"), state("DONE", message="x")])) as server:
            seen = [s.state.value for s in lightmill.Farm(server.url, reconnect_seconds=GENEROUS_S).job("j1").watch()]
        self.assertEqual(seen, ["running", "paused", "done"])

    def test_it_gives_up(self):
        with self.assertRaises(lightmill.Unreachable):
            list(lightmill.Farm(GONE, reconnect_seconds=0).job("j1").watch())
        with Coordinator((404, {"code": 5, "message": "no job"})) as server, self.assertRaises(lightmill.NotFound):
            list(lightmill.Farm(server.url).job("j1").watch())

    def test_wait_says_how_it_ended(self):
        with Coordinator((200, [state("DONE", spp=4)])) as server:
            self.assertEqual(lightmill.Farm(server.url).job("j1").wait().spp, 4)
        for end in ("FAILED", "CANCELLED"):
            with Coordinator((200, [state(end, message="the scene is bad")])) as server:
                with self.assertRaisesRegex(lightmill.JobFailed, "the scene is bad") as caught:
                    lightmill.Farm(server.url).job("j1").wait()
                self.assertTrue(caught.exception.status.state.final)
        with Coordinator((200, [state("RUNNING")] * 3)) as server, self.assertRaises(lightmill.WaitTimeout):
            lightmill.Farm(server.url).job("j1").wait(0)


class Asynchronous(unittest.TestCase):
    def test_the_same_verbs(self):
        async def main(url):
            farm = lightmill.AsyncFarm(url)
            job = farm.job("j1")
            self.assertEqual([s.state.value async for s in job.watch()], ["running", "done"])
            self.assertIs((await job.wait()).state, lightmill.JobState.DONE)
            with self.assertRaises(lightmill.NotFound):
                await job.status()

        stream = (200, [state("RUNNING"), state("DONE")])
        with Coordinator(stream, stream, (404, {"code": 5, "message": "no"})) as server:
            asyncio.run(main(server.url))

    def test_scenes_become_frames_one_by_one_and_are_cancelled_if_one_fails(self):
        good = scenes.SceneCheck(bundle_json="{}", settings_json="{}")
        with Coordinator((200, {"sequence_id": "s1"}), (200, {})) as server:
            made = lightmill.Farm(server.url).submit_checked([(3, good), (4, good)], name="shot", fps=25)
            self.assertEqual(made.id, "s1")
            first, second = (json.loads(body) for *_, body in server.seen)
            self.assertEqual(([f["number"] for f in first["frames"]], first["fps"], second["frames"][0]["number"]), ([3], 25, 4))
        with Coordinator((200, {"sequence_id": "s1"}), (200, {})) as server:
            bad = scenes.SceneCheck(errors=["scene.pbrt:1:1: no"])
            with self.assertRaisesRegex(lightmill.InvalidArgument, "scene.pbrt:1:1: no"):
                lightmill.Farm(server.url).submit_checked([(3, good), (4, bad)], name="shot")
            self.assertEqual([path for _, path, *_ in server.seen], ["/v1/sequences", "/v1/sequences/s1:cancel"])
            with self.assertRaises(lightmill.InvalidArgument):
                lightmill.Farm(server.url).submit_checked([], name="shot")

    def test_addresses_that_are_none(self):
        for address in ("what is this", "ftp://farm", "farm:port", ""):
            with self.assertRaises(lightmill.InvalidArgument):
                lightmill.Farm([address])

    def test_every_verb_is_there(self):
        for plain, other in ((lightmill.Farm, lightmill.AsyncFarm), (lightmill.Job, lightmill.AsyncJob),
                             (lightmill.Sequence, lightmill.AsyncSequence)):
            verbs = {name for name in vars(plain) if not name.startswith("_")}
            self.assertLessEqual(verbs, set(vars(other)), plain.__name__)

    def test_a_task_that_is_cancelled_ends_though_the_coordinator_is_silent(self):
        release = threading.Event()

        with Coordinator((200, {})) as server:
            handler = server.server.RequestHandlerClass

            def wait(self):
                server.seen.append(self.path)
                release.wait(GENEROUS_S)
                self.close_connection = True
            handler.do_GET = wait

            async def main():
                job = lightmill.AsyncFarm(server.url).job("j1")
                before = set(threading.enumerate())
                task = asyncio.create_task(job.wait())
                while not server.seen:
                    await asyncio.sleep(0.01)
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await task
                self.assertTrue(task.cancelled())
                end = time.monotonic() + GENEROUS_S
                while any(t.name == "lightmill" for t in set(threading.enumerate()) - before):
                    self.assertLess(time.monotonic(), end, "its thread goes on")
                    await asyncio.sleep(0.01)

            try:
                asyncio.run(main())
            finally:
                release.set()


if __name__ == "__main__":
    unittest.main(verbosity=1)
