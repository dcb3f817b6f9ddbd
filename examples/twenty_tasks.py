"""Twenty things to do with a release, five lines each at most: `python examples/twenty_tasks.py RELEASE FOLDER`.

RELEASE needs scores (`wsm score`) and a selection `hard` (`wsm select`). What is drawn or written goes to FOLDER. Needs
the extra `notebook`, for tables of pandas.
"""

import io
import sys
from pathlib import Path

import cv2
import numpy as np
import torch
import trimesh
import webdataset
from matplotlib.figure import Figure
from torch.utils.data import DataLoader

from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.clips.tum_sequence import write_tum_sequence
from wsm_data.geometry.transform import transform_points
from wsm_data.loaders.loader import ClipLoader
from wsm_data.view.clip.contact_sheet import draw_contact_sheet
from wsm_data.view.clip.facts import clip_facts, world_path_m
from wsm_data.view.navigation.clip_film import write_clip_film

place, out = sys.argv[1], Path(sys.argv[2])
release = open_release(place)
key = release.keys(split="train")[0]

# 1. How long are the clips of each split?
table = release.to_pandas()
print(table.groupby("split").frames.describe())

# 2. Plot clearance against difficulty.
hard = release.selection("hard")
axes = Figure().add_subplot(xlabel="least clearance (m)", ylabel="difficulty")
axes.scatter(table.loc[hard.keys.to_pylist()].clearance_least_m, hard.scores)
axes.figure.savefig(out / "difficulty.png")

# 3. Frame 7 of a clip as a PNG, and its metric depth as an array.
seen = release.decode(key, frames=[7])
cv2.imwrite(str(out / "frame.png"), seen.rgb[0][..., ::-1])
np.save(out / "depth_m.npy", seen.depth_m[0])

# 4. Train a net of one's own on poses: how far is the goal, from how the first five frames move?
data = release.dataset(split="train", transform=lambda clip: (clip["poses"][:5].ravel(), clip["goal_camera0_m"].norm()))
net = torch.nn.Linear(35, 1)
optimizer = torch.optim.Adam(net.parameters())
for poses, distance_m in DataLoader(data, batch_size=2):
    (net(poses)[:, 0] - distance_m).square().mean().backward(), optimizer.step(), optimizer.zero_grad()

# 5. The hard clips of one home as films.
home = release.index.row(hard.keys[0].as_py()).physical_scene
for one in hard.keys.to_pylist():
    if release.index.row(one).physical_scene == home:
        write_clip_film(release[one], release.codec(), out / f"{one.replace('/', '_')}.mp4")

# 6. The path of a clip in the world, in metres, as a CSV.
clip = release[key]
np.savetxt(out / "path.csv", world_path_m(clip), delimiter=",", header="x_m,y_m,z_m", comments="")

# 7. Draw the map of a clip in world coordinates, with its path.
axes, (left, low), grid = Figure().add_subplot(), clip.grid.origin_xy_m, clip.grid
extent = (left, left + grid.cells.shape[1] * grid.resolution_m, low, low + grid.cells.shape[0] * grid.resolution_m)
axes.imshow(grid.cells == 1, origin="lower", extent=extent, cmap="Greys")
axes.plot(*world_path_m(clip)[:, :2].T)
axes.figure.savefig(out / "map.png")

# 8. How far is it to the goal region from a place in the world?
column, row = clip.grid.fractional_cells(world_path_m(clip)[0, :2]).round().astype(int)
print("distance to the goal region:", clip.geodesic_mm[row, column] / 1000, "m")

# 9. A frame as a coloured point cloud in the first camera's frame.
K, depth_m = clip.intrinsics, seen.depth_m[0]
v, u = np.nonzero(seen.measured[0])
rays = np.stack([(u - K.cx) / K.fx, (v - K.cy) / K.fy, np.ones(len(u))], axis=1)
trimesh.PointCloud(rays * depth_m[v, u, None], colors=seen.rgb[0][v, u]).export(out / "frame.ply")

# 10. Which clips pass closely by something, and go a long way round?
print(table.query("clearance_least_m < 0.5 and detour_ratio > 1.2").index.tolist())

# 11. Why was each hard clip chosen?
for one, why in zip(hard.keys.to_pylist(), hard.why.to_pylist(), strict=True):
    print(one, why)

# 12. Batches of standardised latents, poses and goals, as training reads them.
loader = ClipLoader(place, batch=2)
for batch in loader:
    print(batch.step, "of", len(loader), batch.rgb.shape)

# 13. A clip as a sequence of TUM's RGB-D benchmark.
write_tum_sequence(out / "tum", clip, release.decode(clip, frames=range(clip.meta.recorded_frames)))

# 14. A clip as a contact sheet.
draw_contact_sheet(clip, release.codec(), out / "sheet.png")

# 15. Latents as the model sees them: standardised with the statistics of the release.
mean, std = (
    np.array(one)[:, None, None] for one in (release.manifest.rgb_statistics.mean, release.manifest.rgb_statistics.std)
)
print("mean and std:", ((clip.rgb_latent - mean) / std).mean(), ((clip.rgb_latent - mean) / std).std())

# 16. One clip as a tar of its own, without decoding anything.
(out / "clip.tar").write_bytes(bytes(release.read_clip_bytes(key)) + bytes(1024))

# 17. Is every byte as it was written?
print("what is damaged:", verify_release(place))

# 18. Where is the camera at the last frame of each latent, in the world?
last_m = clip.latent_poses[:, -1, :3].astype(np.float64)
print(transform_points(clip.meta.T_world_camera0_matrix, last_m))

# 19. What was refused, and why?
for refusal in release.quarantine:
    print(refusal["unit"], refusal["reason"])

# 20. Read a shard without this project.
sample = next(iter(webdataset.WebDataset(f"{place}/{release.manifest.shards[0].name}", shardshuffle=False)))
print(sample["__key__"], np.load(io.BytesIO(sample["poses.npy"])).shape, clip_facts(clip).path_length_m)
