"""Names of the files of a release."""

import re

MANIFEST_NAME = "dataset.json"
INDEX_NAME = "index.parquet"
INVENTORY_NAME = "inventory.parquet"
QUARANTINE_NAME = "quarantine.jsonl"
SCORES_NAME = "scores.parquet"
SELECTIONS_FOLDER = "selections"

TRAIN_SPLIT = "train"
"""The split over which the statistics of the latents are taken."""

_SPLIT = re.compile(r"[a-z][a-z0-9_]*")
_SHARD = re.compile(r"[a-z][a-z0-9_]*-[0-9]{6,}\.tar")


def shard_name(split: str, number: int) -> str:
    """Name of the shard `number` of a split, such as `train-000000.tar`.

    Raises:
        ValueError: the split is not a lower-case word, so that its shards would not be recognised.
    """
    if not _SPLIT.fullmatch(split):
        raise ValueError(f"a split must be a word of a-z, 0-9 and _, starting with a letter, found {split!r}")
    return f"{split}-{number:06d}.tar"


def is_shard_name(name: str) -> bool:
    """Whether a file of this name in a release folder is one of its shards."""
    return bool(_SHARD.fullmatch(name))
