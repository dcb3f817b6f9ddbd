"""Megatron-Energon: the same tars with its index, members decoded without a copy, stacked in batches."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from megatron.energon import (
    Cooker,
    DefaultTaskEncoder,
    WorkerConfig,
    basic_sample_keys,
    get_savable_loader,
    get_train_dataset,
    stateless,
)
from torch.utils.data import default_collate

from loader_peers import with_webdataset
from loader_peers.arrays import BATCH, NAMES, Batch
from loader_peers.contestant import SEED, Contestant, Setting

SHUFFLED_CLIPS = 24


def write(folder: Path) -> None:
    """The tars of webdataset, made a dataset of Energon's with its own tool."""
    with_webdataset.write(folder)
    energon = Path(sys.executable).with_name("energon")
    options = ["--non-interactive", "--no-progress", "--split-ratio", "1,0,0", "--sample-type", "CrudeWebdataset"]
    subprocess.run([energon, "prepare", *options, folder], check=True, stdout=sys.stderr)


@stateless
def cook(sample: dict[str, bytes]) -> dict[str, object]:
    """Bytes to tensors, without a copy; the library's own keys are what it restores its state by."""
    tensors = {name: with_webdataset.tensor(sample[f"{name}.npy"]) for name in NAMES}
    return {**tensors, **basic_sample_keys(sample)}


class Encoder(DefaultTaskEncoder):
    """Leaves members as bytes until `cook`, and stacks what `cook` returns."""

    decoder = None
    cookers = (Cooker(cook),)

    def __init__(self) -> None:
        super().__init__(raw_batch_type=dict)

    @stateless
    def batch(self, samples: list[dict[str, object]]) -> dict[str, object]:
        return default_collate([{name: sample[name] for name in NAMES} for sample in samples])


class Opened:
    """A savable loader over one epoch."""

    def __init__(self, setting: Setting):
        dataset = get_train_dataset(
            setting.folder,
            worker_config=WorkerConfig(rank=0, world_size=1, num_workers=setting.workers, seed_offset=SEED),
            batch_size=BATCH,
            shuffle_buffer_size=SHUFFLED_CLIPS if setting.shuffle else None,
            shuffle_over_epochs_multiplier=1 if setting.shuffle else None,
            max_samples_per_sequence=None,  # it has no default
            task_encoder=Encoder(),
            repeat=False,
            parallel_shard_iters=None if setting.shuffle else 1,
        )
        self._loader = get_savable_loader(dataset)

    def epoch(self) -> Iterator[Batch]:
        return iter(self._loader)

    def state(self) -> object:
        return self._loader.save_state_rank()

    def restore(self, state: object) -> None:
        self._loader.restore_state_rank(state)


CONTESTANT = Contestant(write=write, open=Opened)
