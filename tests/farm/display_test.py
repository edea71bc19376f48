"""--display: the picture reaches a viewer that speaks tev's protocol, and no viewer can stop a render; fetch.

    display_test.py --bin build/release/bin
"""
import argparse
import json
import pathlib
import socket
import struct
import subprocess
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from farm import GENEROUS_S, Farm, pixels  # noqa: E402
from paths import ROOM  # noqa: E402
import numpy  # noqa: E402


class Viewer:
    """Parses what it is sent, strictly, into images. `hang_up_after`: packets of a connection before it closes."""

    def __init__(self, hang_up_after=None):
        self.images, self.packets, self.connections, self.error = {}, 0, 0, None
        self.hang_up_after = hang_up_after
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            self.connections += 1
            with connection:
                stream, count = connection.makefile("rb"), 0
                while head := stream.read(4):
                    try:
                        self.packet(stream.read(struct.unpack("<I", head)[0] - 4))
                    except Exception as error:  # the test thread reports it
                        self.error = error
                        return
                    count += 1
                    if count == self.hang_up_after:
                        break

    def packet(self, data):
        self.packets += 1
        at = 0

        def take(form):
            nonlocal at
            values = struct.unpack_from("<" + form, data, at)
            at += struct.calcsize("<" + form)
            return values if len(values) > 1 else values[0]

        def text():
            nonlocal at
            end = data.index(b"\0", at)
            value, at = data[at:end].decode(), end + 1
            return value

        kind, grab = take("BB")
        assert grab in (0, 1)
        name = text()
        if kind == 4:  # create
            width, height = take("ii")
            channels = [text() for _ in range(take("i"))]
            assert channels == ["R", "G", "B"], channels
            self.images[name] = numpy.full((height, width, 3), numpy.nan, numpy.float32)
        elif kind == 6:  # update, version 3
            channels = [text() for _ in range(take("i"))]
            assert channels == ["R", "G", "B"], channels
            x, y, width, height = take("iiii")
            offsets, strides = take("qqq"), take("qqq")
            floats = numpy.frombuffer(data, "<f4", offset=at)
            assert floats.size == max(offsets) + (width * height - 1) * strides[0] + 1, "pixels missing or left over"
            at = len(data)
            target = self.images[name][y:y + height, x:x + width]
            assert target.shape[:2] == (height, width), "outside of the image"
            for c in range(3):
                target[..., c] = floats[offsets[c]::strides[c]][:width * height].reshape(height, width)
        else:
            raise AssertionError(f"unexpected packet type {kind}")
        assert at == len(data), "bytes left over in a packet"

    def close(self):
        self.listener.close()
        if self.error:
            raise self.error


def render(farm, output, *arguments):
    path = farm.folder / output
    done = subprocess.run([farm.bin / "lightmill", "render", ROOM, "--integrator", "pt", "--resolution", "80x48",
                           *map(str, arguments), "-o", path], capture_output=True, text=True, timeout=GENEROUS_S)
    assert done.returncode == 0, done.stderr
    return path, [line for line in done.stderr.splitlines() if "warning" in line]


def test_pixels(farm):
    viewer = Viewer()
    path, warnings = render(farm, "seen.exr", "--spp", 64, "--display", viewer.address)
    viewer.close()
    assert not warnings, warnings
    shown = viewer.images["room"]
    assert numpy.array_equal(shown, pixels(path)), "the last picture shown is not the one written"


def test_absent_and_leaving_viewers(farm):
    path, warnings = render(farm, "alone.exr", "--spp", 16)
    gone = socket.create_server(("127.0.0.1", 0))
    address = "127.0.0.1:%d" % gone.getsockname()[1]
    gone.close()
    absent, warnings = render(farm, "absent.exr", "--spp", 16, "--display", address)
    assert len(warnings) == 1 and address in warnings[0], warnings
    leaving = Viewer(hang_up_after=1)
    left, warnings = render(farm, "left.exr", "--spp", 16, "--display", leaving.address)
    leaving.close()
    assert len(warnings) <= 1, warnings
    assert leaving.connections >= 1
    for other in (absent, left):
        assert numpy.array_equal(pixels(path), pixels(other))


def test_watch(farm):
    farm.start_coordinator()
    farm.start_worker(1)
    job = farm.submit(ROOM, "--integrator", "pt", "--resolution", "640x384", "--spp", 1, "--aov", "depth,alpha")
    viewer = Viewer()
    farm.lightmill("watch", job, "--display", viewer.address)
    path = farm.finish_and_fetch(job, "watched.exr")
    viewer.close()
    assert numpy.array_equal(viewer.images[job], pixels(path)[..., :3])
    told = json.loads(farm.lightmill("fetch", job, "-o", path, "--json"))
    assert told["aov_channels"] == ["depth.Z", "A"] and told["metadata"]["scene"], told
    small = farm.folder / "small.exr"
    farm.lightmill("fetch", job, "--preview", "-o", small)
    whole = pixels(path)[..., :3]
    blocks = whole.reshape(192, 2, 320, 2, 3).mean((1, 3), dtype=numpy.float64)
    assert numpy.allclose(pixels(small), blocks, rtol=1e-6), "a preview is the mean of blocks of pixels"
    farm.lightmill("fetch", job, expect=2)
    farm.lightmill("fetch", job, "--preview", expect=2)  # no terminal to draw on


def test_wrong_address(farm):
    for wrong in ("", ":", "localhost:", "localhost:99999", "localhost:x", "a:1:2"):
        if wrong:
            farm.lightmill("render", ROOM, "--display", wrong, "-o", farm.folder / "no.exr", expect=2, connect=False)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    arguments = parser.parse_args()
    with Farm(arguments.bin) as farm:
        for test in (test_pixels, test_absent_and_leaving_viewers, test_watch, test_wrong_address):
            test(farm)
            print("ok", test.__name__, flush=True)


if __name__ == "__main__":
    main()
