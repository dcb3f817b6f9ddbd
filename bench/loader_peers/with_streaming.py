"""mosaicml-streaming: MDS shards of ndarrays of fixed shape, stacked in batches by its DataLoader."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from streaming import MDSWriter, StreamingDataLoader, StreamingDataset
from streaming.base.util import clean_stale_shared_memory
from torch.utils.data import default_collate

from loader_peers.arrays import BATCH, DTYPES, NAMES, SHAPES, Batch, all_clips
from loader_peers.contestant import SEED, Contestant, Setting

SHARD_BYTES = 100 << 20
COLUMNS = {name: f"ndarray:{DTYPES[name]}:{','.join(map(str, SHAPES[name]))}" for name in NAMES}


def write(folder: Path) -> None:
    """Shards of about 100 MB, neither compressed nor hashed."""
    folder.rmdir()  # the writer wants to make it
    with MDSWriter(out=str(folder), columns=COLUMNS, size_limit=SHARD_BYTES) as writer:
        for arrays in all_clips():
            writer.write(arrays)


def collate(samples: list[dict[str, np.ndarray]]) -> Batch:
    return default_collate([{name: torch.from_numpy(sample[name]) for name in NAMES} for sample in samples])


class Opened:
    """Its dataset in its DataLoader."""

    def __init__(self, setting: Setting):
        clean_stale_shared_memory()
        dataset = StreamingDataset(
            local=str(setting.folder),
            shuffle=setting.shuffle,
            shuffle_seed=SEED,
            batch_size=BATCH,
        )
        workers = {"persistent_workers": True, "prefetch_factor": 2} if setting.workers else {}
        self._loader = StreamingDataLoader(
            dataset, batch_size=BATCH, collate_fn=collate, num_workers=setting.workers, **workers
        )

    def epoch(self) -> Iterator[Batch]:
        return iter(self._loader)

    def state(self) -> object:
        return self._loader.state_dict()

    def restore(self, state: object) -> None:
        self._loader.load_state_dict(state)


CONTESTANT = Contestant(write=write, open=Opened)
