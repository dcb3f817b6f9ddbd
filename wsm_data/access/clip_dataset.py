"""Clips of a release as a map-style torch Dataset, for those who bring a DataLoader of their own."""

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch.utils.data import Dataset

from wsm_data.access.release import Release, open_release
from wsm_data.schema.clip import Clip


class ClipDataset(Dataset[Any]):
    """Clips by their number.

    A sample is a dict of the array members (`MEMBERS`) that the clip has, as tensors that may be written to, of
    `goal_camera0_m` (float32 [3], m), `latent_poses` (float32 [F, 4, 7]) and `key`. It crosses to the workers of a
    DataLoader as a place and keys; files are opened there.
    """

    def __init__(
        self,
        location: str,
        keys: Sequence[str],
        transform: Callable[[dict[str, Any]], Any] | None = None,
        *,
        release: Release | None = None,
    ):
        """Name the clips; none is read yet.

        Args:
            location: folder or URL of the release.
            keys: keys of the clips, in the order of their numbers.
            transform: makes of a sample what the dataset gives.
            release: the release, where it is open.
        """
        self.keys = tuple(keys)
        self._location, self._transform, self._release = location, transform, release

    def __len__(self) -> int:
        return len(self.keys)

    def __getitem__(self, number: int) -> Any:
        if self._release is None:
            self._release = open_release(self._location)
        sample = _sample(self._release.read_clip(self.keys[number]))
        return sample if self._transform is None else self._transform(sample)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_release": None}


def _sample(clip: Clip) -> dict[str, Any]:
    tensors: dict[str, Any] = {name: torch.from_numpy(array.copy()) for name, array in clip.arrays().items()}
    goal = torch.tensor(clip.meta.goal_camera0_m, dtype=torch.float32)
    return tensors | {
        "latent_poses": torch.from_numpy(clip.latent_poses),
        "goal_camera0_m": goal,
        "key": clip.meta.key,
    }
