"""This project: a release, read by `ClipLoader`."""

from collections.abc import Iterator

from loader_peers.arrays import BATCH, FRAMES, LATENTS, Batch
from loader_peers.contestant import SEED, Contestant, Setting
from loader_peers.release import write_release
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig, Verify
from wsm_data.loaders.loader import ClipLoader

IDENTITY_SLOTS = 3
"""Pose slots in front of the first row of poses.npy: latent 0 has four identities, the last of them that row."""


class Opened:
    """A loader whose options are those of `ReadConfig`; latents as stored unless an option asks otherwise."""

    def __init__(self, setting: Setting):
        options = {"standardise": False, "dtype": "float16", **setting.options}
        read = ReadConfig(**{**options, "verify": Verify(options.get("verify", ReadConfig.verify))})
        order = OrderConfig(seed=SEED, shuffle=setting.shuffle, global_batch=BATCH, remainder=Remainder.PAD)
        source = SourceConfig(release=str(setting.folder))
        self._loader = ClipLoader(LoaderConfig(sources=(source,), order=order, read=read))

    def epoch(self) -> Iterator[Batch]:
        for batch in self._loader:
            clips = len(batch.refs)  # rows without a clip fill the last step
            own = [span.row for span in batch.spans]
            rows = slice(clips) if own == list(range(clips)) else own
            poses = batch.poses.view(len(batch.poses), 4 * LATENTS, 7)[rows, IDENTITY_SLOTS:]
            if poses.shape[1] != FRAMES:
                raise ValueError(f"a clip must have {FRAMES} poses, found {poses.shape}")
            yield {
                "rgb_latent": batch.rgb[rows],
                "depth_latent": batch.depth[rows],
                "depth_valid": batch.depth_valid[rows],
                "poses": poses,
            }
            del batch, poses

    def state(self) -> object:
        return self._loader.state_dict()

    def restore(self, state: object) -> None:
        self._loader.load_state_dict(state)


CONTESTANT = Contestant(write=write_release, open=Opened)
