"""The scenes the encode tests share: names of their units, a frame on disk, and running what comes before."""

from box_room import RGB

DEN, HALL, ZED = "box_d435i/den", "box_d435i/hall", "box_zed/hall"
UNITS = [f"{DEN}/000000", f"{HALL}/000000", f"{HALL}/000001", f"{HALL}/000002", f"{ZED}/000000"]


def frame(pipeline, scene, number, kind=RGB, episode=0):
    ending = "jpg" if kind == RGB else "png"
    return pipeline.source / scene / kind / f"episode_{episode:06d}_{number:03d}.{ending}"


def again(pipeline):
    """Run what comes before encode again."""
    for stage in ("index", "split", "map"):
        pipeline.run(stage)
