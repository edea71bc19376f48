#!/usr/bin/python3
"""Submits a scene to a Lightmill farm, follows it and fetches the picture.

    client/python/render.py scenes/cornell-spheres.pbrt --spp 64 -o picture.exr

It needs nothing but Python and the package `lightmill` beside it (docs/http-api.md, docs/clients.md).
"""
import argparse
import sys

from lightmill import Farm, JobStatus, LightmillError


def print_status(status: JobStatus) -> None:
    error = f"  relMSE {status.relmse:.3g}" if status.relmse is not None else ""
    print(f"{status.id} {status.state.value}: {status.packets_done}/{status.packets_total} packets, "
          f"{status.spp:.4g} spp{error}", file=sys.stderr)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scene", help=".pbrt, .gltf or .glb; what it refers to is sent with it")
    parser.add_argument("--coordinator", help="http(s)://HOST:PORT; with standbys all of them, with commas between")
    parser.add_argument("--credentials", help="a folder of lightmill-coordinator grant, for a farm with TLS")
    parser.add_argument("--spp", type=int)
    parser.add_argument("--size", help="WxH")
    parser.add_argument("--integrator", choices=["auto", "bdpt", "pt", "lt", "scene"])
    parser.add_argument("--seed", type=int)
    parser.add_argument("-o", "--output", required=True, help="an .exr or .png file")
    arguments = parser.parse_args()
    try:
        width, height = map(int, arguments.size.split("x")) if arguments.size else (0, 0)
    except ValueError:
        parser.error("--size is WxH, for instance 640x480")
    try:
        farm = Farm(arguments.coordinator, credentials=arguments.credentials)
        job = farm.submit(arguments.scene, spp=arguments.spp, integrator=arguments.integrator, seed=arguments.seed,
                          resolution=(width, height) if arguments.size else None)
        print(job.id, flush=True)
        for line in job.warnings:
            print(f"warning: {line}", file=sys.stderr)
        for status in job.watch():
            print_status(status)
        job.wait()  # raises JobFailed with the reason if it did not end well
        job.save(arguments.output)
    except (LightmillError, OSError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
