from itertools import pairwise

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.loaders.batches.batch import LATENT_DTYPES, BatchBlock, layout_of
from wsm_data.schema.sequence import SequenceSpan

SPAN = SequenceSpan(row=0, start=0, length=1, chunk_size=4)
sizes = st.integers(1, 5)
layouts = st.builds(
    layout_of,
    rows=sizes,
    row_latents=sizes,
    sequences=st.integers(0, 5),
    latent_shape=st.tuples(sizes, sizes, sizes),
    dtype=st.sampled_from(list(LATENT_DTYPES.values())),
)


def _block(layout, fill: int = 0) -> BatchBlock:
    memory = torch.full((layout.size_bytes,), fill, dtype=torch.uint8)
    return BatchBlock(memory=memory, layout=layout, spans=(SPAN,), refs=np.array([5]), keys=("a/b/c",), epoch=2, step=7)


@given(layouts)
def test_tensors_lie_apart_and_aligned_within_the_block(layout):
    places = list(layout.tensors.values())
    assert all(place.offset % 64 == 0 for place in places)
    assert all(one.end <= other.offset for one, other in pairwise(places))
    assert places[-1].end <= layout.size_bytes < places[-1].end + 64


@given(layouts)
def test_each_tensor_has_its_shape_and_dtype_and_is_contiguous(layout):
    rows, latents, (channels, height, width) = layout.rows, layout.row_latents, layout.latent_shape
    batch = _block(layout).batch()
    for latent in (batch.rgb, batch.depth):
        assert (latent.shape, latent.dtype) == ((rows, latents, channels, height, width), layout.dtype)
    assert (batch.depth_valid.shape, batch.depth_valid.dtype) == ((rows, latents, height, width), torch.uint8)
    assert (batch.poses.shape, batch.poses.dtype) == ((rows, latents, 4, 7), torch.float32)
    assert (batch.still.shape, batch.still.dtype) == ((rows, latents, 4), torch.bool)
    for name in ("sequence_id", "latent_index"):
        assert (getattr(batch, name).shape, getattr(batch, name).dtype) == ((rows, latents), torch.int32)
    assert (batch.goal_camera0_m.shape, batch.goal_camera0_m.dtype) == ((layout.sequences, 3), torch.float32)
    assert all(tensor.is_contiguous() for tensor in vars(batch).values() if isinstance(tensor, torch.Tensor))
    assert (batch.spans, batch.refs.tolist(), batch.keys, batch.epoch, batch.step) == ((SPAN,), [5], ("a/b/c",), 2, 7)


def test_what_is_written_to_one_tensor_is_in_no_other():
    block = _block(layout_of(3, 4, 5, (2, 3, 3), torch.float16))
    for name, tensor in block.tensors.items():
        tensor.fill_(1)
        assert {other for other, values in block.tensors.items() if values.any()} == {name}
        tensor.zero_()
