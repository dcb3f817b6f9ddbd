import pickle
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError


def _goal(sample: dict[str, object]) -> object:
    return sample["goal_camera0_m"]


def test_samples_are_the_clips_of_a_split_as_tensors_of_their_own(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    for split in release.index.counts("split"):
        dataset = release.dataset(split=split)
        assert list(dataset.keys) == release.keys(split=split)
        for number, key in enumerate(dataset.keys):
            sample, clip = dataset[number], release[key]
            assert sample["key"] == key
            assert all(np.array_equal(sample[name].numpy(), array) for name, array in clip.arrays().items())
            np.testing.assert_array_equal(sample["latent_poses"].numpy(), clip.latent_poses)
            sample["rgb_latent"].zero_()  # may be written to, and leaves the next reading alone
            assert dataset[number]["rgb_latent"].any()


def test_workers_of_a_data_loader_open_the_release_themselves(tiny: SimpleNamespace) -> None:
    dataset = open_release(tiny.folder).dataset(transform=_goal)
    assert pickle.loads(pickle.dumps(dataset)).keys == dataset.keys  # noqa: S301 - our own bytes
    found = torch.cat(list(DataLoader(dataset, batch_size=4, num_workers=1)))
    wanted = [open_release(tiny.folder)[key].meta.goal_camera0_m for key in dataset.keys]
    torch.testing.assert_close(found, torch.tensor(wanted))


def test_a_split_that_is_not_there_is_refused_with_those_that_are(tiny: SimpleNamespace) -> None:
    with pytest.raises(ConfigError, match=r"must have clips of split 'tran', found .*train"):
        open_release(tiny.folder).dataset(split="tran")
