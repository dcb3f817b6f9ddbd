"""webdataset: tars of npy members, decoded without a copy, stacked in batches."""

import io
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import torch
import webdataset
from torch.utils.data import default_collate

from loader_peers.arrays import BATCH, NAMES, Batch, all_clips
from loader_peers.contestant import SEED, Contestant, Setting

CLIPS_IN_A_TAR = 50
SHUFFLED_CLIPS = 24


def write(folder: Path) -> None:
    """Tars of 50 clips, about 100 MB each."""
    with webdataset.ShardWriter(str(folder / "%06d.tar"), maxcount=CLIPS_IN_A_TAR, verbose=0) as writer:
        for number, arrays in enumerate(all_clips()):
            writer.write({"__key__": f"{number:06d}", **{f"{name}.npy": arrays[name] for name in NAMES}})


def tensor(data: bytes) -> torch.Tensor:
    """A view of the bytes of an npy file; numpy's own reader, webdataset's choice, would copy them."""
    header = io.BytesIO(data[:256])
    np.lib.format.read_magic(header)
    shape, _, dtype = np.lib.format.read_array_header_1_0(header)
    return torch.from_numpy(np.frombuffer(data, dtype, offset=header.tell()).reshape(shape))


def decode(sample: dict[str, bytes]) -> Batch:
    return {name: tensor(sample[f"{name}.npy"]) for name in NAMES}


class Opened:
    """A pipeline, and a DataLoader around it where workers are asked for."""

    def __init__(self, setting: Setting):
        tars = sorted(str(path) for path in setting.folder.glob("*.tar"))
        pipeline = webdataset.WebDataset(
            tars,
            shardshuffle=len(tars) if setting.shuffle else False,
            seed=SEED,
            workersplitter=webdataset.split_by_worker,
        )
        if setting.shuffle:
            pipeline = pipeline.shuffle(SHUFFLED_CLIPS, initial=SHUFFLED_CLIPS, seed=SEED)
        pipeline = pipeline.map(decode).batched(BATCH, collation_fn=default_collate)
        self._loader = pipeline
        if setting.workers:
            self._loader = webdataset.WebLoader(
                pipeline, batch_size=None, num_workers=setting.workers, persistent_workers=True, prefetch_factor=2
            )

        self._delivered = self._skip = 0

    def epoch(self) -> Iterator[Batch]:
        for batch in islice(self._loader, self._skip, None):
            self._delivered += 1
            yield batch
            del batch

    def state(self) -> object:
        """The library keeps no place: the number of batches that were delivered is all there is."""
        return self._delivered

    def restore(self, state: int) -> None:
        """Read what was delivered again, and throw it away."""
        self._skip = state


CONTESTANT = Contestant(write=write, open=Opened)
