"""Chunks and where sequences stand."""

import pytest
import torch

from wsm_model.mot.chunks import SequenceSpan, chunk_bounds, chunk_numbers, frame_table


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
@pytest.mark.parametrize("length", [1, 2, 5, 9])
def test_numbers_and_bounds_tell_the_same_chunks(length, chunk_size):
    numbers = chunk_numbers(torch.arange(length), torch.tensor(chunk_size)).tolist()
    bounds = chunk_bounds(length, chunk_size)
    assert numbers == [number for number, (first, end) in enumerate(bounds) for _ in range(first, end)]
    assert bounds[0] == (0, 1)
    assert all(end - first == chunk_size for first, end in bounds[1:-1])


def test_a_table_says_sequence_latent_and_chunk_of_every_frame():
    spans = [
        SequenceSpan(row=0, start=1, length=4, chunk_size=2),
        SequenceSpan(row=1, start=0, length=2, chunk_size=4),
    ]
    table = frame_table(spans, 2, 5)
    assert table.sequence.tolist() == [[-1, 0, 0, 0, 0], [1, 1, -1, -1, -1]]
    assert table.latent.tolist() == [[0, 0, 1, 2, 3], [0, 1, 0, 0, 0]]
    assert table.chunk.tolist() == [[0, 0, 1, 1, 2], [0, 1, 0, 0, 0]]


@pytest.mark.parametrize(
    "spans",
    [
        [SequenceSpan(row=0, start=0, length=6, chunk_size=1)],
        [SequenceSpan(row=1, start=0, length=2, chunk_size=1)],
        [SequenceSpan(row=0, start=0, length=3, chunk_size=1), SequenceSpan(row=0, start=2, length=2, chunk_size=1)],
    ],
    ids=["too long", "no such row", "two at one place"],
)
def test_sequences_that_do_not_fit_are_refused(spans):
    with pytest.raises(ValueError, match="must have a place of its own"):
        frame_table(spans, 1, 5)
