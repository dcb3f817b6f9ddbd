"""A release of short clips of many lengths, loaders over it, and what their batches must hold, said slowly."""

import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tiny_release import build_clip, pack

from wsm_data.access.release import Release, open_release
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.schema.clip import Clip

CLIPS = 26
LATENTS = (2, 5, 3, 6, 2, 4, 1)
SHARD_BYTES = 300_000  # three to six clips


@dataclass(frozen=True)
class Released:
    """A release in a folder, and all of its clips by key."""

    folder: Path
    release: Release
    clips: dict[str, Clip]

    def copied(self, folder: Path) -> Path:
        """A copy that a test may damage."""
        return Path(shutil.copytree(self.folder, folder))


@pytest.fixture(scope="session")
def released(tmp_path_factory: pytest.TempPathFactory) -> Released:
    folder = tmp_path_factory.mktemp("loaders") / "release"
    clips = [
        build_clip(
            f"synth_d435i/home_{number // 4:04d}/{number:06d}",
            latents=LATENTS[number % len(LATENTS)],
            padded_frames=(0, 2, 0, 5)[number % 4] if LATENTS[number % len(LATENTS)] > 2 else 0,
        )
        for number in range(CLIPS)
    ]
    pack(folder, clips, shard_bytes=SHARD_BYTES)
    release = open_release(folder)
    return Released(folder, release, {key: release.read_clip(key) for key in release.index.texts("key")})


@pytest.fixture
def make_loader(released: Released) -> Iterator[Callable[..., ClipLoader]]:
    """Makes loaders; keyword arguments are settings of the order or of the reading, whichever have them."""
    with ExitStack() as stack:

        def make(
            folder: Path | None = None, *, rank: int = 0, world_size: int = 1, ledger: str = "", **settings: object
        ) -> ClipLoader:
            reading = {name: settings.pop(name) for name in list(settings) if name in ReadConfig.__dataclass_fields__}
            config = LoaderConfig(
                sources=(SourceConfig(release=str(folder or released.folder)),),
                order=OrderConfig(**{"global_batch": 4, "seed": 3} | settings),
                read=ReadConfig(**reading),
                ledger=ledger,
            )
            return stack.enter_context(ClipLoader(config, rank=rank, world_size=world_size))

        yield make


@pytest.fixture(scope="session")
def expected_batch() -> Callable[..., dict[str, np.ndarray]]:
    return _expected_batch


def _expected_batch(batch: Batch, clips: dict[str, Clip], row_latents: int = 0) -> dict[str, np.ndarray]:
    """The arrays of a batch with latents as they are stored, from where its sequences lie; one slot after the other."""
    rows = len(batch.rgb)
    sequences = [(key, span.row, span.start, span.length) for key, span in zip(batch.keys, batch.spans, strict=True)]
    longest = row_latents or max([start + length for _, _, start, length in sequences], default=1)
    shape = next(iter(clips.values())).rgb_latent.shape[1:]
    expected = {
        "rgb": np.zeros((rows, longest, *shape), np.float16),
        "depth": np.zeros((rows, longest, *shape), np.float16),
        "depth_valid": np.zeros((rows, longest, *shape[1:]), np.uint8),
        "poses": np.zeros((rows, longest, 4, 7), np.float32),
        "still": np.zeros((rows, longest, 4), bool),
        "sequence_id": np.full((rows, longest), -1, np.int32),
        "latent_index": np.zeros((rows, longest), np.int32),
        "goal_camera0_m": np.zeros((len(sequences), 3), np.float32),
    }
    for number, (key, row, start, length) in enumerate(sequences):
        clip = clips[key]
        expected["goal_camera0_m"][number] = clip.poses[-1, :3]
        for latent in range(length):
            at = row, start + latent
            expected["rgb"][at] = clip.rgb_latent[latent]
            expected["depth"][at] = clip.depth_latent[latent]
            expected["depth_valid"][at] = clip.depth_valid[latent]
            expected["sequence_id"][at] = number
            expected["latent_index"][at] = latent
            for slot in range(4):
                frame = 4 * (latent - 1) + slot + 1 if latent else 0
                expected["poses"][(*at, slot)] = clip.poses[frame]
                expected["still"][(*at, slot)] = frame >= clip.frame_count - clip.meta.padded_frames
    return expected
