"""From releases to what the model is fed with, and what is told of them."""

import logging
from dataclasses import replace

import torch

from pipelines.training.config import HeldOutConfig, TrainRunConfig
from wsm_data.access.release import Release, open_release
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.config import Arrangement, LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.sources.clips import Sources, SourceTable
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.manifest import ReleaseManifest
from wsm_data.shards.release_codec import codec_of
from wsm_model.config import ModelConfig, Variant
from wsm_model.evaluation.decoding import Decoding
from wsm_model.presets import preset

_LOG = logging.getLogger(__name__)


def training_loader(
    config: TrainRunConfig, device: torch.device, ledger: str, rank: int, world_size: int
) -> ClipLoader:
    """The loader of this rank, with its ledger in the run's folder.

    Raises:
        ConfigError: the settings do not fit the releases, or would leave a rank without rows.
        IntegrityError: a release is damaged.
    """
    if world_size > 1 and config.order.remainder is Remainder.PAD:
        raise ConfigError(
            "order.remainder = pad leaves ranks of the last step without rows, and the others would wait for them for "
            "ever; choose drop or repeat"
        )
    is_pinned = device.type == "cuda"
    read = replace(config.read, device=str(device), pin_memory=is_pinned)
    settings = LoaderConfig(
        sources=config.sources, order=config.order, read=read, ledger=ledger, depth=needs_depth(config)
    )
    return ClipLoader(settings, rank=rank, world_size=world_size)


def held_out_loader(config: TrainRunConfig, device: torch.device) -> ClipLoader | None:
    """Clips of the first source that are not trained on, one by one; None where its release has none.

    They come in an order of their own, always the same, so that a few of them are not all of one scene.
    """
    held_out, source = config.held_out, config.sources[0]
    manifest = open_release(source.release).manifest
    if not manifest.clips_by_split.get(held_out.split):
        _LOG.warning("release %s has no clips of the split %r: nothing is held out", manifest.name, held_out.split)
        return None
    return clips_loader(source.release, held_out, device, depth=needs_depth(config), standard=config.read.standard)


def clips_loader(
    release: str,
    held_out: HeldOutConfig,
    device: torch.device,
    *,
    depth: bool,
    seed: int = 0,
    standard: LatentStandard | None = None,
) -> ClipLoader:
    """Clips of a release's split, one by one, in an order of the seed alone, by their own standard if none is given.

    Raises:
        ConfigError: there is no such release or split, or a clip has no depth though it is asked for.
        IntegrityError: the release is damaged.
    """
    source = SourceConfig(release=release, split=held_out.split)
    settings = _one_by_one(source, held_out, device, depth=depth, seed=seed, standard=standard)
    return ClipLoader(settings, rank=0, world_size=1)


def clip_batch(release: Release, key: str, held_out: HeldOutConfig, device: torch.device, *, depth: bool) -> Batch:
    """One clip of any split, as a loader gives it.

    Raises:
        ConfigError: there is no such clip, or it has no depth though it is asked for.
        IntegrityError: it is damaged.
    """
    release.index.row(key)  # refuses a key that is not there
    source = SourceConfig(release=release.store.root, split="")
    table = SourceTable(config=source, release=release, selection="", rows=release.index.rows_of([key]), base=0)
    settings = _one_by_one(source, held_out, device, depth=depth, seed=0)
    with ClipLoader(settings, rank=0, world_size=1, sources=Sources((table,))) as loader:
        return next(iter(loader))


def _one_by_one(
    source: SourceConfig,
    held_out: HeldOutConfig,
    device: torch.device,
    *,
    depth: bool,
    seed: int,
    standard: LatentStandard | None = None,
) -> LoaderConfig:
    order = OrderConfig(
        seed=seed,
        shuffle=True,
        global_batch=1,
        remainder=Remainder.DROP,
        arrangement=Arrangement.PLAIN,
        max_latents=held_out.max_latents,
        chunk_sizes=(held_out.session.chunk_size,),
    )
    read = ReadConfig(device=str(device), threads=1, prefetch_batches=1, standard=standard)
    return LoaderConfig(sources=(source,), order=order, read=read, depth=depth)


def decoding_of(manifest: ReleaseManifest, codec_weights: str, standard: LatentStandard | None = None) -> Decoding:
    """What turns latents of a release into pictures; they are standardised by its own standard if none is given.

    Raises:
        ConfigError: the codec cannot be built, or these are not its weights.
    """
    return Decoding(
        codec=codec_of(manifest, codec_weights),
        standard=standard or latent_standard(manifest),
        depth_range=manifest.depth_range,
    )


def needs_depth(config: TrainRunConfig) -> bool:
    """Whether the model learns depth, and so every clip must have it."""
    return config.model.variant is Variant.SLAM


def model_config(config: TrainRunConfig, manifest: ReleaseManifest) -> ModelConfig:
    """The chosen size for the latents of a release: their channels, rows and columns.

    Raises:
        ConfigError: there is no such size, or the latents cannot be cut into patches.
    """
    ratio = manifest.codec.spatial_ratio
    height, width = manifest.encoded_height_px // ratio, manifest.encoded_width_px // ratio
    try:
        found = preset(config.model.size, latent_height=height, latent_width=width, variant=config.model.variant)
    except ValueError as error:
        raise ConfigError(f"release {manifest.name} does not fit the model: {error}") from error
    prediction = config.model.prediction or found.prediction
    return replace(found, latent_channels=manifest.codec.channels, prediction=prediction)
