import numpy as np
import pytest
import torch

from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.config import Arrangement, ReadConfig, Remainder, SourceConfig
from wsm_data.loaders.order.epoch_order import chunk_sizes
from wsm_data.loaders.reading.step_reader import StepReader
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.timing import Timing

STORED = {"standardise": False, "dtype": "float16"}


def _require_equal(batch: Batch, expected: dict[str, np.ndarray]) -> None:
    for name, array in expected.items():
        found = getattr(batch, name).numpy()
        assert found.dtype == array.dtype, name
        np.testing.assert_array_equal(found, array, err_msg=name)


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"max_latents": 3},
        {"max_latents": 1},
        {"verify": "never", "max_latents": 2},
        {"verify": "always"},
        {"arrangement": Arrangement.BUCKET, "pool": 3},
        {"arrangement": Arrangement.JOIN, "row_latents": 9, "global_batch": 2},
        {"arrangement": Arrangement.JOIN, "row_latents": 9, "global_batch": 2, "max_latents": 4, "verify": "never"},
        {"remainder": Remainder.PAD},
    ],
    ids=str,
)
def test_batches_hold_what_the_clips_hold(released, make_loader, expected_batch, settings):
    """Twice, so that prefixes are read once with checksums and once without; every buffer has been used before then."""
    loader = make_loader(**STORED, **settings)
    count = 0
    for _ in range(2):
        for batch in loader:
            _require_equal(batch, expected_batch(batch, released.clips, settings.get("row_latents", 0)))
            count += len(batch.keys)
    assert count > released.release.manifest.clips


def test_rows_are_those_of_the_order(released, make_loader):
    loader = make_loader(**STORED, arrangement=Arrangement.JOIN, row_latents=9, global_batch=2)
    epoch_order = loader.epoch_order
    for batch in loader:
        rows = epoch_order.rows(batch.step, 0, 1)
        assert batch.refs.tolist() == np.concatenate(rows).tolist()
        assert [span.row for span in batch.spans] == [row for row, refs in enumerate(rows) for _ in refs]
        assert batch.keys == tuple(loader.sources.keys(batch.refs))
        assert [span.chunk_size for span in batch.spans] == chunk_sizes(
            batch.refs, epoch_order.config, epoch_order.epoch
        ).tolist()
        assert batch.epoch == epoch_order.epoch == 0


def test_a_batch_of_padding_alone_has_one_latent_and_no_sequence(make_loader):
    loader = make_loader(**STORED, remainder=Remainder.PAD, global_batch=8, rank=3, world_size=4, shuffle=False)
    *_, last = loader
    assert last.keys == ()
    assert last.rgb.shape[:2] == (2, 1)
    assert not last.rgb.any()
    assert not last.poses.any()
    assert (last.sequence_id == -1).all()
    assert last.goal_camera0_m.shape == (0, 3)


def test_stored_latents_come_without_a_copy(released, make_loader):
    """The arrays of a batch lie in the one block that its clips were read into."""
    batch = next(iter(make_loader(**STORED)))
    tensors = [value for value in vars(batch).values() if isinstance(value, torch.Tensor)]
    assert len({tensor.untyped_storage().data_ptr() for tensor in tensors}) == 1


def test_two_sources_of_one_release_share_its_reader(released):
    sources = open_sources([SourceConfig(release=str(released.folder)), SourceConfig(release=str(released.folder))])
    reader = StepReader(sources, ReadConfig(), Timing(), rank=0, world_size=1)
    assert reader.readers[0] is reader.readers[1]
    reader.close()
