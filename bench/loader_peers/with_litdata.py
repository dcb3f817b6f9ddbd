"""litdata: chunks of tensors, stacked in batches by its DataLoader."""

from collections.abc import Iterator
from pathlib import Path

import torch
from litdata import StreamingDataLoader, StreamingDataset
from litdata.streaming.writer import BinaryWriter

from loader_peers.arrays import BATCH, Batch, all_clips
from loader_peers.contestant import SEED, Contestant, Setting

CHUNK_BYTES = 64 << 20


def write(folder: Path) -> None:
    """Chunks of 64 MB, litdata's default, not compressed."""
    writer = BinaryWriter(str(folder), chunk_bytes=CHUNK_BYTES)
    for number, arrays in enumerate(all_clips()):
        writer[number] = {name: torch.from_numpy(array) for name, array in arrays.items()}
    writer.done()
    writer.merge()


class Opened:
    """Its dataset in its DataLoader."""

    def __init__(self, setting: Setting):
        dataset = StreamingDataset(str(setting.folder), shuffle=setting.shuffle, seed=SEED)
        workers = {"persistent_workers": True, "prefetch_factor": 2} if setting.workers else {}
        self._loader = StreamingDataLoader(dataset, batch_size=BATCH, num_workers=setting.workers, **workers)

    def epoch(self) -> Iterator[Batch]:
        return iter(self._loader)

    def state(self) -> object:
        return self._loader.state_dict()

    def restore(self, state: object) -> None:
        self._loader.load_state_dict(state)


CONTESTANT = Contestant(write=write, open=Opened)
