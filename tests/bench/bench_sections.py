"""The sections of the page of results: each takes the page and a Size and writes its part.

Runs of what is compared alternate, so that other load of the machine meets all alike; figures are medians with least and
greatest. Rates by CPU time hardly depend on that load, those by wall time do.
"""
import contextlib
import pathlib
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass

from bench_common import BENCH, BUILD, CORES, ROOT, SHARED, farm_render, figures, output, spread
from lamps_scene import LAMPS, lamps_scene

OWN = {name: (ROOT / "scenes" / f"{name}.pbrt", "300x300") for name in ("cornell-spheres", "ring-caustic")}
PEERS = {f"cornell-peers/{name}": (SHARED / "cornell-peers" / f"{name}.pbrt", "512x512") for name in ("diffuse", "glass")}
OTHERS = {name: (SHARED / name / "scene-v4.pbrt", size)
          for name, size in {"veach-mis": "320x180", "veach-bidir": "320x320", "coffee": "240x300", "staircase2": "256x256",
                             "dining-room": "320x180", "veach-ajar": "320x180", "water-caustic": "256x256",
                             "kitchen": "320x180"}.items()}


@dataclass
class Size:
    """How much is measured: `tiny` only shows that everything runs."""
    runs: int
    tiny: bool = False

    def scenes(self, *groups):
        """(name, path, resolution) of the scenes that are there, and a note on those that are not."""
        all_scenes = [(name, *place) for group in groups for name, place in group.items()]
        if self.tiny:
            all_scenes = [(name, path, "40x40") for name, path, _ in all_scenes][:1]
        absent = [name for name, path, _ in all_scenes if not path.exists()]
        note = f"Not here and left out: {', '.join(absent)}." if absent else ""
        return [s for s in all_scenes if s[1].exists()], note

    def spp(self, usual):
        return 1 if self.tiny else usual


def throughput(page, size):
    page.heading("Throughput of the bare renderer")
    page.paragraph(f"Samples/s by wall time on {CORES} threads; the rest by CPU time. Stages in µs per pixel sample, of one "
                   "thread with a probe; tracing: the part of its time spent casting paths and testing shadow rays.")
    scenes, note = size.scenes(PEERS, OWN, OTHERS)

    def rows():
        for name, path, resolution in scenes:
            for integrator in ("pt", "bdpt", "lt"):
                options = {"integrator": integrator, "resolution": resolution}
                spp = size.spp(16)
                runs = [figures("bench_render", path, spp=spp, **options) for _ in range(size.runs)]
                stages = figures("bench_stages", path, spp=size.spp(4), **options)
                us = statistics.median(r["us_per_sample"] for r in runs)
                yield (name, integrator, spread([r["msamples_per_s"] for r in runs]), f"{us:.2f}",
                       spread([r["mrays_per_cpu_s"] for r in runs]),
                       *(f"{us * stages['stages'][s]:.3f}" for s in
                         ("produce", "cast", "bounce", "connect", "occlude", "film", "other")),
                       f"{stages['in_traversal']:.0%}", f"{runs[0]['closest_rays_per_sample']:.2f}",
                       f"{runs[0]['shadow_rays_per_sample']:.2f}", runs[0]["nonfinite"])

    page.table(["scene", "integrator", "Msamples/s", "µs CPU/sample", "Mrays/CPU s", "produce", "cast", "bounce", "connect",
                "occlude", "film", "other", "tracing", "closest/sample", "shadow/sample", "nonfinite"], rows())
    if note:
        page.paragraph(note)


def limit(page, size):
    page.heading("Against the limit: the same rays in bare Embree")
    page.paragraph("The rays of a render of one thread are traced once more, packed ready eight by eight, by nothing but "
                   "rtcIntersect8 and rtcOccluded8 in a scene of the same flags. Ratio: that time over the render's; 100 % is "
                   "a renderer that costs nothing.")
    scenes, note = size.scenes({name: OTHERS[name] for name in ("veach-bidir", "kitchen")})

    def rows():
        for name, path, resolution in scenes:
            for integrator in ("pt", "bdpt"):
                r = figures("bench_stages", path, "--limit", integrator=integrator, resolution=resolution,
                            spp=size.spp(8), runs=max(size.runs, 1 if size.tiny else 5))
                yield (name, integrator, spread([100 * x for x in r["limit_ratio"]]) + " %",
                       spread(r["embree_closest_mrays"]), spread(r["embree_occlusion_mrays"]), f"{r['in_traversal']:.0%}",
                       f"{r['rays_replayed'] / 1e6:.2f}")

    page.table(["scene", "integrator", "limit / ours", "Embree closest Mrays/s", "Embree occlusion Mrays/s",
                "ours inside the tracer", "Mrays replayed"], rows())
    if note:
        page.paragraph(note)


def counts_to(most):
    """1, 2, 4, ... and `most` itself."""
    return sorted({most} | {2**k for k in range(10) if 2**k < most})


def scaling(page, size):
    page.heading("Scaling over threads")
    scenes, _ = size.scenes(PEERS, OWN)
    name, path, resolution = scenes[0]
    spp = size.spp(64)
    page.paragraph(f"{name}, samples/s of the bare renderer over that of one thread, in turn; CPU: what a sample costs over one "
                   "thread's, which other load of the machine does not show in.")

    def thread_rows():
        for integrator in ("pt", "bdpt"):
            rates = {n: [] for n in counts_to(CORES)}
            cpu = {n: [] for n in rates}
            for _ in range(size.runs):
                for n in rates:
                    r = figures("bench_render", path, integrator=integrator, resolution=resolution, spp=spp, threads=n)
                    rates[n].append(r["msamples_per_s"])
                    cpu[n].append(r["us_per_sample"])
            for n in rates:
                yield (integrator, n, spread(rates[n]), spread([a / b for a, b in zip(rates[n], rates[1])]),
                       spread([a / b for a, b in zip(cpu[n], cpu[1])]))

    page.table(["integrator", "threads", "Msamples/s", "speed-up", "CPU per sample"], thread_rows())
    page.heading("Scaling over workers")
    page.paragraph("The same job on a farm of real processes on loopback, each worker of one thread, by the job's own wall time "
                   "from submission to the last commit.")
    sys.path.insert(0, str(ROOT / "tests" / "farm"))
    with contextlib.redirect_stdout(sys.stderr):
        from farm import Farm  # says why on stdout and ends if its packages are not there

    def worker_rows():
        walls = {n: [] for n in counts_to(CORES)}
        for _ in range(size.runs):
            for n in walls:
                with Farm(BUILD / "bin") as farm:
                    farm.start_coordinator()
                    for _ in range(n):
                        farm.start_worker(1)
                    # One job first, so that every worker has the scene.
                    for samples in (n, spp):
                        job = farm.submit(path, "--integrator", "pt", "--resolution", resolution, "--spp", samples)
                        while (status := farm.json("job", job))["state"] != "done":
                            time.sleep(0.2)
                walls[n].append(status["wall_seconds"])
        for n in walls:
            yield n, spread(walls[n]), spread([a / b for a, b in zip(walls[1], walls[n])])

    page.table(["workers", "wall s", "speed-up"], worker_rows())


def memory(page, size):
    page.heading("Memory and start")
    page.paragraph(f"Peak resident set, and seconds until the first packet ({CORES} threads, warm disk): process start, "
                   "reading, building. Scene: what the renderer's arrays, textures and tree take.")
    with tempfile.TemporaryDirectory() as folder:
        scenes, note = size.scenes(OTHERS if not size.tiny else OWN)
        if not size.tiny:
            grid = pathlib.Path(folder) / "grid.pbrt"
            write_grid_scene(grid, 866)
            scenes.append(("a grid of 1.5 M triangles", grid, "320x180"))

        def rows():
            for name, path, resolution in scenes:
                runs, walls = [], []
                for _ in range(size.runs):
                    start = time.monotonic()
                    runs.append(figures("bench_render", path, integrator="pt", spp=1, resolution=resolution))
                    walls.append(time.monotonic() - start - runs[-1]["render_s"])
                yield (name, spread([r["peak_mb"] for r in runs], 4), f"{runs[0]['scene_mb']:.4g}",
                       spread([r["load_s"] for r in runs]), spread([r["build_s"] for r in runs]), spread(walls))

        page.table(["scene", "peak MB", "scene MB", "load s", "build s", "all until the first packet s"], rows())
    if note:
        page.paragraph(note)


def write_grid_scene(path, side):
    """A wavy plane of 2 side^2 triangles as a binary PLY file, under a lamp."""
    import numpy
    u, v = numpy.meshgrid(numpy.linspace(-1, 1, side + 1), numpy.linspace(-1, 1, side + 1))
    points = numpy.stack([u, 0.05 * numpy.sin(20 * u) * numpy.cos(17 * v), v], -1).reshape(-1, 3).astype("<f4")
    corner = (numpy.arange(side)[:, None] * (side + 1) + numpy.arange(side)).reshape(-1)
    faces = numpy.empty(2 * side * side, dtype=[("n", "u1"), ("v", "<i4", 3)])
    faces["n"] = 3
    faces["v"][0::2] = numpy.stack([corner, corner + 1, corner + side + 1], -1)
    faces["v"][1::2] = numpy.stack([corner + 1, corner + side + 2, corner + side + 1], -1)
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.with_suffix(".ply").write_bytes(header.encode() + points.tobytes() + faces.tobytes())
    path.write_text('LookAt 0 1 -2  0 0 0  0 1 0\nCamera "perspective" "float fov" 50\nWorldBegin\n'
                    'LightSource "point" "rgb I" [1 1 1] "point3 from" [0 2 0]\n'
                    f'Shape "plymesh" "string filename" "{path.stem}.ply"\n')


def queues(page, size):
    page.heading("Private wavefronts against global queues between the stages")
    page.paragraph("The same stages, bits and threads: a thread that takes its wavefront through all stages, against five global "
                   "queues, a lock each, from which any thread takes what is next (4 wavefronts in flight per thread). Paths: "
                   "of a wavefront, the unit that passes through a queue. Ratios: queues over private, run by run.")
    scenes, note = size.scenes(OWN, {name: OTHERS[name] for name in ("veach-bidir", "kitchen")})

    def rows():
        for name, path, resolution in scenes:
            for integrator in ("pt", "bdpt"):
                for one_in in (1, 16, 256):
                    r = figures("bench_queues", path, integrator=integrator, resolution=resolution, one_in=one_in,
                                spp=size.spp(8), runs=size.runs)
                    ratio = {k: [a / b for a, b in zip(r["queues"][k], r["private"][k])] for k in ("wall_s", "cpu_s")}
                    yield (name, integrator, 1024 // one_in, spread(ratio["wall_s"]), spread(ratio["cpu_s"]),
                           f"{statistics.median(r['queues']['switches']):.0f} / {statistics.median(r['private']['switches']):.0f}")

    page.table(["scene", "integrator", "paths", "wall", "CPU", "context switches"], rows())
    if note:
        page.paragraph(note)


def lights(page, size):
    page.heading("Many lights")
    page.paragraph(f"µs CPU per sample, depth 5; of {LAMPS} lamps those that shine.")

    def rows():
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "lamps.pbrt"
            for count in (10, 1000, LAMPS):
                path.write_text(lamps_scene(count))
                yield (count, *(spread([figures("bench_render", path, integrator=integrator, spp=size.spp(16),
                                                resolution="32x32" if size.tiny else None)["us_per_sample"]
                                        for _ in range(size.runs)]) for integrator in ("pt", "bdpt")))

    page.table(["lights", "pt", "bdpt"], rows())


def farm(page, size):
    page.heading("What the embedded farm costs over the bare renderer")
    page.paragraph("The same packets bare and through scheduler, encoding, commit and fold: wall time, pair by pair.")
    scene = OWN["cornell-spheres"][0]

    def rows():
        with tempfile.TemporaryDirectory() as folder:
            for integrator in ("pt", "bdpt"):
                ratios = []
                for _ in range(1 if size.tiny else max(size.runs, 5)):
                    bare = figures("bench_render", scene, integrator=integrator, spp=size.spp(128))["render_s"]
                    wall, _ = farm_render(scene, f"{folder}/o.exr", "--integrator", integrator, "--spp", size.spp(128))
                    ratios.append(wall / bare)
                yield integrator, spread(ratios)

    page.table(["integrator", "farm / bare"], rows())


def merge(page, size):
    page.heading("Merging partials in memory")
    page.paragraph("GB/s of sums (48 bytes a pixel and layer). Fold: adding decoded sums to the film. Merge: what the coordinator "
                   "does with a partial: unpacking, digests, checks, film and error batches. One thread by its CPU time; "
                   f"{CORES} threads by wall time: with a job each, and handing in to one job.")

    def rows():
        for integrator in ("pt", "bdpt"):
            for resolution in ("512x512", "1920x1080"):
                runs = [figures("fold_rate", OWN["cornell-spheres"][0], integrator=integrator, samples=size.spp(16), threads=CORES,
                                resolution="64x64" if size.tiny else resolution, seconds=0.01 if size.tiny else 1)
                        for _ in range(size.runs)]
                yield (integrator, resolution, f"{runs[0]['partial_bytes'] / 1e6:.2f}", f"{runs[0]['sum_bytes'] / 1e6:.1f}",
                       *(spread([r[rate] for r in runs]) for rate in ("film_gbps", "merge_gbps", "merge_threads_gbps", "merge_job_gbps")))

    page.table(["integrator", "image", "MB encoded", "MB of sums", "fold", "merge", f"{CORES} threads", "to one job"], rows())


def kernels(page, size):
    import json
    page.heading("Stages and kernels one by one")
    page.paragraph("Google Benchmark on the middle packet of cornell-spheres, one thread: millions of items (paths, vertices, rays, "
                   "numbers, look-ups) per CPU second. TextureInCache: beyond --texture-memory; 0: close look-ups, 1: anywhere.")
    document = json.loads(output(BENCH / "bench_kernels", "--benchmark_format=json",
                                 f"--benchmark_min_time={0.01 if size.tiny else 0.2}",
                                 f"--benchmark_repetitions={size.runs}"))
    rates = {}
    for b in document["benchmarks"]:
        if b["run_type"] == "iteration":
            rates.setdefault(b["run_name"], []).append(b["items_per_second"] * 1e-6)
    page.table(["kernel", "M items/CPU s"], [(name, spread(r)) for name, r in rates.items()])


JUDGED_RENDER_S = 30  # of a render: what its pilot and its curve cost is judged beside that


def planning(page, size):
    cpu_s = JUDGED_RENDER_S * CORES
    page.heading("Planning, and recording the error curve")
    page.paragraph(f"CPU seconds of one thread. Plan: what is not needed, found out; its share is of reading and building. Pilot of "
                   f"auto at 1280x720; its share is of a render of {JUDGED_RENDER_S} s on {CORES} threads. Curve: folding into "
                   "batches and estimating errors, over rendering the same samples, in such a render by pt.")
    scenes, note = size.scenes(OWN, PEERS, OTHERS)

    def rows():
        for name, path, _ in scenes:
            large = "40x40" if size.tiny else "1280x720"
            plans = [figures("plan_cost", path, resolution=large) for _ in range(size.runs)]
            curve = figures("curve_cost", path, integrator="pt", resolution=large, spp=16 if size.tiny else 1 << 20, seconds=cpu_s)
            yield (name, spread([r["load_s"] + r["build_s"] for r in plans]), spread([r["plan_s"] for r in plans]),
                   f"{statistics.median(r['plan_share'] for r in plans):.3%}", spread([r["pilot_s"] for r in plans]),
                   f"{statistics.median(r['pilot_s'] for r in plans) / cpu_s:.2%}", curve["spp"], f"{curve['share']:.2%}")

    page.table(["scene", "reading and building s", "plan s", "share", "pilot s", "share", "spp", "curve"], rows())
    if note:
        page.paragraph(note)


FULL_LOAD = 0.7  # of a core, beyond which calls begin to wait for each other (farm_sim.cc)


def simulated(page, size):
    import json
    page.heading("Farms in simulation")
    page.paragraph("Scheduler, leases and merger on a simulated clock: workers of drawn speeds that come late, die and return, and an "
                   "image that would take ten minutes. Efficiency: of all workers' time what ended in the image. Tail: from when "
                   "the first worker finds nothing to do, of the whole. Load: of a coordinator's core, measured here in its core, "
                   f"0.4 ms of RPC a tile and 0.1 ms a renewal assumed; at {FULL_LOAD:.0%} calls begin to wait, and the jobs want "
                   "another coordinator, or one job a tree of mergers (farm_sim says which).")

    def rows():
        for workers in (10,) if size.tiny else (10, 100, 1000, 10000):
            r = json.loads(output(BENCH / "farm_sim", workers, 5 if size.tiny else 600, "--json"))
            load = r["tile_load"] + r["renewal_load"]
            yield (workers, f"{r['efficiency']:.2%}", f"{r['tail']:.2%}", r["tiles"], f"{r['tiles'] / r['seconds']:.3g}",
                   f"{r['commit_bytes'] / r['seconds'] / 1e6:.3g}", f"{load:.1%}", f"{r['renewal_load'] / load:.0%}",
                   f"{workers / load * FULL_LOAD:.0f}")

    page.table(["workers", "efficiency", "tail", "tiles", "tiles/s", "MB/s", "coordinator's core", "of it renewals",
                "workers that one core bears"], rows())


SECTIONS = {f.__name__: f for f in (throughput, limit, scaling, memory, queues, kernels, lights, farm, merge, simulated,
                                      planning)}
