from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import SequenceSpan


def test_a_batch_of_any_kind_of_tensor_is_frozen_and_says_where_its_sequences_lie():
    """Here of numpy's arrays: one row of three latents, whose second and third are a sequence."""
    tensors = {
        field.name: np.arange(3)[None] for field in fields(ClipBatch) if field.name not in ("spans", "refs", "keys")
    }
    known = {"refs": np.array([7]), "keys": ("a/b/c",), "epoch": 1, "step": 4}
    spans = (SequenceSpan(row=0, start=1, length=2, chunk_size=4),)
    batch: ClipBatch[np.ndarray] = ClipBatch(**(tensors | known), spans=spans)
    assert [batch.rgb[span.place].tolist() for span in batch.spans] == [[1, 2]]
    assert replace(batch, step=5).refs is batch.refs
    with pytest.raises(FrozenInstanceError):
        batch.step = 5
