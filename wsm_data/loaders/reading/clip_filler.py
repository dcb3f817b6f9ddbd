"""One clip into its batch: read to where it belongs, checked where that is due, and standardised on the way."""

import logging
import threading
from collections.abc import Sequence
from math import prod

import numpy as np
import torch

from wsm_data.access.shard_reader import ShardReader
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import LATENT_DTYPES, LATENT_TENSORS, BatchBlock
from wsm_data.loaders.batches.filling import MEMBER_OF, BatchSequence, slots_of
from wsm_data.loaders.batches.standardise import convert, standardisations
from wsm_data.loaders.config import ReadConfig
from wsm_data.loaders.reading.clip_reads import read_clip
from wsm_data.loaders.reading.verification import verification_of
from wsm_data.loaders.sources.clips import Sources
from wsm_data.loaders.timing import Part, Timing

_LOG = logging.getLogger(__name__)
_STORED = torch.float16


class ClipFiller:
    """Fills batches with clips. Safe to be used by several threads.

    Latents are standardised here for the processor; for another device they stay as they are stored.

    Attributes:
        latent_shape: channels, height and width of a latent.
        dtype: dtype of the latents of the batches that are filled.
    """

    def __init__(
        self, sources: Sources, read: ReadConfig, readers: Sequence[ShardReader], timing: Timing, *, depth: bool = True
    ):
        """Look up what latents are, and how they are standardised.

        Args:
            sources: the clips.
            read: the settings.
            readers: of the shards of each source.
            timing: adds up the time of reading, checking and standardising.
            depth: whether batches have depth.

        Raises:
            ConfigError: a dtype that latents cannot have, or no statistics to standardise by.
        """
        if read.dtype not in LATENT_DTYPES:
            raise ConfigError(f"dtype must be one of {', '.join(LATENT_DTYPES)}, found {read.dtype!r}")
        manifest = sources.tables[0].release.manifest
        codec = manifest.codec
        cells = (manifest.encoded_height_px // codec.spatial_ratio, manifest.encoded_width_px // codec.spatial_ratio)
        as_stored = torch.device(read.device).type != "cpu"  # not looked for: a forked process must not ask for it
        self.latent_shape = (codec.channels, *cells)
        self.dtype = _STORED if as_stored else LATENT_DTYPES[read.dtype]
        here = read.standardise and not as_stored
        self._standardise = standardisations(manifest, depth=depth, standard=read.standard) if here else {}
        if (
            self._standardise
            and read.standard is None
            and len({table.release.store.root for table in sources.tables}) > 1
        ):
            _LOG.warning("latents of all sources are standardised by the statistics of the first, %s", manifest.name)
        self._latents = LATENT_TENSORS if depth else LATENT_TENSORS[:1]
        self._converts = self.dtype is not _STORED or bool(self._standardise)
        self._verification = verification_of(sources.tables, read)
        self._readers, self._timing = readers, timing
        self._staging = threading.local()

    def fill(self, block: BatchBlock, clip: BatchSequence) -> np.ndarray:
        """Read one clip into its batch.

        Returns:
            The last camera position of the whole clip in the first camera's frame, m; float32 [3].

        Raises:
            IntegrityError: its bytes are not those that the release vouches for; names shard and clip.
            StoreError: a store failed for good.
            OSError: the system refuses to read.
        """
        place = clip.place
        staged = self._staged(clip.span.length) if self._converts else {}
        slots = slots_of(block, clip)
        slots |= {MEMBER_OF[name]: memoryview(latents.numpy()).cast("B") for name, latents in staged.items()}
        due = self._verification.is_due(place.source, place.number)
        reader = self._readers[place.source]
        last_pose = read_clip(reader, place, self.latent_shape, slots, checked=due, timing=self._timing)
        if due:
            self._verification.passed(place.source, place.number)
        for name, latents in staged.items():
            with self._timing.measure(Part.COLLATE):
                convert(latents, block.tensors[name][clip.span.place], self._standardise.get(name))
        return last_pose[:3]

    def _staged(self, latents: int) -> dict[str, torch.Tensor]:
        """Memory of this thread for the stored latents of a clip; it stays in the cache from clip to clip."""
        shape = (len(self._latents), latents, *self.latent_shape)
        size = prod(shape)
        held = getattr(self._staging, "held", None)
        if held is None or len(held) < size:
            held = self._staging.held = torch.empty(size, dtype=_STORED)
        return dict(zip(self._latents, held[:size].view(shape), strict=True))
