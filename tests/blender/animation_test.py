"""Animations of the render engine on a farm of real processes.

    animation_test.py --bin build/release/bin [PART...]
"""
import argparse

import numpy

from blender_runs import Blender, Farm, error_lines, interrupt, pixels, said, wait_until

MOVING = """
s.frame_start, s.frame_end = 1, 4
s.lightmill.coordinator = "http://{http}"
s.lightmill.samples = {samples}
cube = bpy.data.objects["Cube"]
for frame, x in ((1, -3), (4, 3)):
    cube.location.x = x
    cube.keyframe_insert("location", frame=frame)
"""
NO_PROGRAM = {"LIGHTMILL_PROGRAM": "/nowhere/lightmill", "PATH": "/usr/bin:/bin"}


def frames(blender):
    return [pixels(blender.picture(number)) for number in range(1, 5)]



def dying_worker(blender, farm):
    """The farm needs nothing on this machine. Frames are under way before Blender comes to them; a worker dies meanwhile,
    and the pictures are those of a farm where none does."""
    farm.start_coordinator()
    farm.start_worker(2)
    script = MOVING.format(http=farm.http, samples=64)
    blender.run("-a", script=script, environment=NO_PROGRAM)
    want = frames(blender)
    for number in range(3):
        assert numpy.abs(want[number] - want[number + 1]).mean() > 0.005, "the cube moves"
    assert len(farm.json("jobs")) == 4, "each frame is one job"
    script = MOVING.format(http=farm.http, samples=64) + "s.lightmill.priority = 3\n"
    process = blender.start("-a", script=script, environment=NO_PROGRAM)
    wait_until("frames ahead", lambda: len(farm.json("jobs")) > 5)
    farm.workers[0].kill()
    farm.workers[0].wait()
    farm.start_worker(2)
    assert process.wait(300) == 0, said(process)
    got = frames(blender)
    for number in range(4):
        assert (want[number] == got[number]).all(), f"frame {number + 1} differs"
    assert all(job["state"] == "done" for job in farm.json("jobs")), farm.json("jobs")


def lost_coordinator(blender, farm):
    """A coordinator that is away for a while is waited for, with a word; one that stays away ends the render."""
    farm.start_coordinator()
    farm.start_worker(2)
    endless = MOVING.format(http=farm.http, samples=0) + "s.lightmill.time_limit = 3600\ns.frame_end = 1\n"
    process = blender.start("-a", script=endless, environment=NO_PROGRAM)
    wait_until("samples", lambda: " samples" in said(process))
    farm.kill_coordinator()
    wait_until("a word", lambda: "waiting for the coordinator" in said(process))
    farm.start_coordinator()
    told = len(said(process))
    wait_until("samples again", lambda: " samples" in said(process)[told:].replace("waiting for the coordinator", ""))
    interrupt(process)
    wait_until("the job's end", lambda: all(job["state"] == "cancelled" for job in farm.json("jobs")))
    quick = 'import addon_utils\naddon_utils.enable("lightmill", default_set=True)\n' \
            'bpy.context.preferences.addons["lightmill"].preferences.reconnect_seconds = 1\n'
    process = blender.start("-a", script=quick + endless, environment=NO_PROGRAM)
    wait_until("samples", lambda: " samples" in said(process))
    farm.kill_coordinator()
    assert process.wait(300) == 1, said(process)
    assert len(error_lines(said(process))) == 1, said(process)


SUBMIT = """
bpy.context.scene.render.engine = "LIGHTMILL"
bpy.context.scene.view_layers[0].use_pass_z = True
assert bpy.ops.lightmill.submit_animation() == {{"FINISHED"}}
print("submitted", s.lightmill.sequence)
import lightmill_api
lightmill_api.Farm("http://{http}").sequence(s.lightmill.sequence).wait(300)
s.render.filepath = {folder!r} + "/fetched####"
assert bpy.ops.lightmill.fetch_animation() == {{"FINISHED"}}
assert s.frame_current == 1
"""


def left_to_the_farm(blender, farm):
    """The operators submit all frames as one sequence, and fetch them. A render after it is a render."""
    farm.start_coordinator()
    farm.start_worker(2)
    text = blender.run("-f", 1, environment=NO_PROGRAM, script=MOVING.format(http=farm.http, samples=16)
                       + SUBMIT.format(http=farm.http, folder=str(blender.folder)))
    assert "submitted s" in text, text
    fetched = [pixels(blender.folder / f"fetched{number:04}.exr") for number in range(1, 5)]
    assert fetched[0].shape == (64, 96, 4), fetched[0].shape  # with the depth
    for number in range(3):
        assert numpy.abs(fetched[number] - fetched[number + 1]).mean() > 0.001, "the cube moves"
    assert numpy.allclose(fetched[0][..., :3], pixels(blender.picture())[..., :3], atol=1e-5), "the same job"


PARTS = {f.__name__: f for f in (dying_worker, lost_coordinator, left_to_the_farm)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("part", nargs="*")
    arguments = parser.parse_args()
    for part in arguments.part or PARTS:
        with Blender(arguments.bin) as blender, Farm(arguments.bin) as farm:
            PARTS[part](blender, farm)
            print(f"ok: {part}", flush=True)


if __name__ == "__main__":
    main()
