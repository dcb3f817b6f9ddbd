"""The physical limit: the bytes of the same clips brought into memory that is used again, and nothing else done."""

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from loader_peers.arrays import BATCH, CLIP_BYTES, Batch
from loader_peers.contestant import SEED, Contestant, Setting
from loader_peers.release import write_release
from wsm_data.access.release import open_release


class Pread:
    """pread of the four arrays of each clip, which lie in one stretch, by one thread or by several.

    Options: `threads`; `buffer_clips`, how many clips the reused buffer of each thread holds.
    """

    def __init__(self, setting: Setting):
        index = open_release(setting.folder).index
        files = {name: os.open(setting.folder / name, os.O_RDONLY) for name in sorted(set(index.texts("shard")))}
        self._places = [
            (files[name], int(offset))
            for name, offset in zip(index.texts("shard"), index.numbers("rgb_latent_offset"), strict=True)
        ]
        if setting.shuffle:
            self._places = [self._places[i] for i in np.random.default_rng(SEED).permutation(len(self._places))]
        self._threads = int(setting.options["threads"])
        self._buffers = [
            np.ones((int(setting.options["buffer_clips"]), CLIP_BYTES), np.uint8) for _ in range(self._threads)
        ]

    def epoch(self) -> Iterator[Batch]:
        """Views of the buffers; with several threads after all of them have been filled for the last time."""
        if self._threads == 1:
            yield from self._read(0)
            return
        with ThreadPoolExecutor(self._threads) as pool:
            for batches in pool.map(lambda thread: list(self._read(thread)), range(self._threads)):
                yield from batches

    def _read(self, thread: int) -> Iterator[Batch]:
        buffer = self._buffers[thread]
        for start in range(thread * BATCH, len(self._places), self._threads * BATCH):
            places = self._places[start : start + BATCH]
            for number, (file, offset) in enumerate(places):
                count = os.preadv(file, [buffer[number % len(buffer)]], offset)
                if count != CLIP_BYTES:
                    raise OSError(f"{CLIP_BYTES} bytes were to be read, found {count}")
            yield {"bytes": torch.from_numpy(buffer[:1]).expand(len(places), CLIP_BYTES)}


class Memcpy:
    """Copies of all clips, already in memory, into a buffer of one batch."""

    def __init__(self, setting: Setting):
        clips = len(open_release(setting.folder).index)
        self._source = np.ones((clips, CLIP_BYTES), np.uint8)
        self._buffer = np.ones((BATCH, CLIP_BYTES), np.uint8)

    def epoch(self) -> Iterator[Batch]:
        for start in range(0, len(self._source), BATCH):
            clips = self._source[start : start + BATCH]
            self._buffer[: len(clips)] = clips
            yield {"bytes": torch.from_numpy(self._buffer[: len(clips)])}


def opened(setting: Setting) -> Pread | Memcpy:
    return Memcpy(setting) if setting.options.get("memcpy") else Pread(setting)


CONTESTANT = Contestant(write=write_release, open=opened)
