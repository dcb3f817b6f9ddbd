"""From releases to what a model is fed with: shapes, statistics, held-out clips, and what is refused."""

import logging
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from pipelines.training.config import HeldOutConfig, ModelChoice, TrainRunConfig
from pipelines.training.data import held_out_loader, model_config, training_loader
from wsm_data.errors import ConfigError
from wsm_data.loaders.config import OrderConfig, ReadConfig, Remainder, SourceConfig
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.manifest import ReleaseManifest, manifest_bytes
from wsm_data.shards.statistics import LatentStatistics
from wsm_model.config import Prediction, Variant

CPU = torch.device("cpu")
NO_STATISTICS = LatentStatistics(mean=(), std=(), count=0)


@pytest.fixture
def run_config(tiny) -> Callable[..., TrainRunConfig]:
    """Settings of a run over the tiny release, read in this thread."""

    def make(*others: Path, **changes: object) -> TrainRunConfig:
        sources = tuple(SourceConfig(release=str(folder)) for folder in (tiny.folder, *others))
        settings = {"order": OrderConfig(global_batch=2), "read": ReadConfig(threads=0)}
        return TrainRunConfig(sources=sources, **(settings | changes))

    return make


def copy_with(tiny: SimpleNamespace, **changes: object) -> Path:
    """A copy of the tiny release whose manifest says something else."""
    other = Path(shutil.copytree(tiny.folder, tiny.folder.with_name("other")))
    (other / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, **changes)))
    return other


def open_loader(config: TrainRunConfig, world_size: int = 1):
    return training_loader(config, CPU, "", 0, world_size)


def test_a_loader_gives_the_steps_of_the_settings_on_the_device_asked_for(run_config):
    with open_loader(run_config()) as loader:
        assert loader.steps == 2  # five training clips, two a step
        batch = next(iter(loader))
    assert batch.rgb.device == CPU
    assert len(batch.keys) == 2


def test_statistics_that_are_missing_are_told_before_any_step(run_config, tiny):
    other = copy_with(tiny, rgb_statistics=NO_STATISTICS, depth_statistics=NO_STATISTICS)
    config = replace(run_config(), sources=(SourceConfig(release=str(other)),))
    with pytest.raises(ConfigError, match=r"tiny must have latent statistics to standardise by"):
        open_loader(config)


def test_releases_of_two_codecs_are_not_mixed(run_config, tiny):
    other = copy_with(tiny, codec=replace(tiny.codec, digest="another"))
    with pytest.raises(ConfigError, match=r"latents of codecs must not be mixed; found dct .digest another"):
        open_loader(run_config(other))


def test_padded_steps_are_refused_where_a_rank_would_have_no_row(run_config):
    config = run_config(order=OrderConfig(global_batch=2, remainder=Remainder.PAD))
    with pytest.raises(ConfigError, match=r"order\.remainder = pad leaves ranks .* without rows"):
        open_loader(config, world_size=2)
    with open_loader(config) as loader:
        assert loader.steps == 3


def manifest(tiny: SimpleNamespace, **changes: object) -> ReleaseManifest:
    return replace(tiny.manifest, **changes)


def test_a_model_takes_rows_columns_and_channels_of_the_latents(run_config, tiny):
    choice = ModelChoice(size="tiny", variant=Variant.IDM)
    found = model_config(run_config(model=choice), manifest(tiny, codec=replace(tiny.codec, channels=16)))
    assert (found.latent_height, found.latent_width, found.latent_channels) == (6, 10, 16)
    assert (found.layers, found.variant) == (6, Variant.IDM)


@pytest.mark.parametrize(("chosen", "wanted"), [(None, Prediction.CLEAN), (Prediction.VELOCITY, Prediction.VELOCITY)])
def test_a_prediction_that_is_chosen_comes_before_that_of_the_size(run_config, tiny, chosen, wanted):
    choice = ModelChoice(size="tiny", prediction=chosen)
    assert model_config(run_config(model=choice), manifest(tiny)).prediction is wanted


@pytest.mark.parametrize("size", [{"encoded_height_px": 80}, {"encoded_width_px": 176}])
def test_images_whose_latents_cannot_be_cut_into_patches_are_refused(run_config, tiny, size):
    with pytest.raises(ConfigError, match=r"release tiny does not fit the model: latents of .* cannot be cut into"):
        model_config(run_config(), manifest(tiny, **size))


def test_the_standard_is_what_the_loader_applies(run_config, tiny):
    """A batch times std plus mean is what is stored."""
    standard = latent_standard(tiny.manifest)
    stored = {clip.meta.key: clip for clip in tiny.clips}
    with held_out_loader(run_config(), CPU) as loader:
        batch = next(iter(loader))
    clip = stored[batch.keys[0]]
    for name, mean, std in (
        ("rgb", standard.rgb_mean, standard.rgb_std),
        ("depth", standard.depth_mean, standard.depth_std),
    ):
        scale, offset = (torch.tensor(values).view(-1, 1, 1) for values in (std, mean))
        found = getattr(batch, name)[0] * scale + offset
        wanted = torch.tensor(getattr(clip, f"{name}_latent")).float()
        torch.testing.assert_close(found, wanted, rtol=1e-5, atol=1e-5)


def test_held_out_clips_come_one_by_one_and_cut(run_config, tiny):
    config = run_config(held_out=HeldOutConfig(max_latents=2))
    with held_out_loader(config, CPU) as loader:
        batches = list(loader)
    test_keys = sorted(clip.meta.key for clip in tiny.clips[-2:])
    assert sorted(key for batch in batches for key in batch.keys) == test_keys
    assert [len(batch.keys) for batch in batches] == [1, 1]
    assert all([span.length for span in batch.spans] == [2] for batch in batches)
    assert all([span.chunk_size for span in batch.spans] == [4] for batch in batches)


def test_a_split_without_clips_holds_nothing_out_and_says_so(run_config, caplog):
    with caplog.at_level(logging.WARNING):
        assert held_out_loader(run_config(held_out=HeldOutConfig(split="val")), CPU) is None
    assert "release tiny has no clips of the split 'val': nothing is held out" in caplog.text
