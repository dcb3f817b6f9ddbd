import numpy as np
import pytest

from wsm_data.schema.sequence import (
    SequenceSpan,
    chunk_bounds,
    chunk_numbers,
    chunk_start,
    frame_table,
    frames_of,
    latent_of,
)


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
@pytest.mark.parametrize("length", [1, 2, 5, 9])
def test_numbers_and_bounds_tell_the_same_chunks(length, chunk_size):
    numbers = chunk_numbers(np.arange(length), chunk_size).tolist()
    bounds = chunk_bounds(length, chunk_size)
    assert numbers == [number for number, (first, end) in enumerate(bounds) for _ in range(first, end)]
    assert [chunk_start(latent, chunk_size) for latent in range(length)] == [bounds[number][0] for number in numbers]
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


def test_a_later_latent_covers_four_frames():
    assert [frames_of(latents) for latents in (1, 2, 3)] == [1, 5, 9]
    assert [latent_of(frame) for frame in range(9)] == [0, 1, 1, 1, 1, 2, 2, 2, 2]


def test_the_place_of_a_sequence_picks_it_out_of_an_array():
    rows = np.arange(12).reshape(2, 6)
    assert rows[SequenceSpan(row=1, start=2, length=3, chunk_size=1).place].tolist() == [8, 9, 10]


@pytest.mark.parametrize("changes", [{"length": 0}, {"chunk_size": 0}, {"row": -1}, {"start": -1}], ids=str)
def test_a_sequence_without_a_place_or_a_length_is_refused(changes):
    with pytest.raises(ValueError, match="needs a place, a length and a chunk size"):
        SequenceSpan(**({"row": 0, "start": 0, "length": 1, "chunk_size": 1} | changes))
