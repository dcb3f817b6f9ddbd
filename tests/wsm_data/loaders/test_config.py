"""Settings of a loader: what makes no sense is refused where it is written."""

import math

import numpy as np
import pytest

from wsm_data.loaders.config import Arrangement, LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.order.mixing import stretch_of_epoch
from wsm_data.loaders.order.stable_hash import mix64


@pytest.mark.parametrize("weight", [0.0, -1.0, math.nan, math.inf, np.float64(math.inf)])
def test_a_source_has_a_finite_weight_above_0(weight):
    with pytest.raises(ValueError, match="leave the source out"):
        SourceConfig(release="release", weight=weight)


@pytest.mark.parametrize("weight", [np.float64(0.25), np.float32(0.25), 0.25])
def test_weights_of_numpy_are_those_of_python(weight):
    source = SourceConfig(release="release", weight=weight)
    assert repr(source.weight) == "0.25"
    assert stretch_of_epoch(10, source.weight, 1) == (2, 5)


def test_a_seed_is_a_word_of_64_bits():
    largest = OrderConfig(seed=(1 << 64) - 1)
    assert mix64(np.arange(3), largest.seed).tolist() != mix64(np.arange(3), 0).tolist()
    with pytest.raises(ValueError, match=r"seed must be below 2\^64, found 18446744073709551616"):
        OrderConfig(seed=1 << 64)


@pytest.mark.parametrize("name", ["window_blocks", "global_batch", "pool"])
def test_these_numbers_of_an_order_are_at_least_1(name):
    OrderConfig(**{name: 1})
    with pytest.raises(ValueError, match=f"{name} must be at least 1, found 0"):
        OrderConfig(**{name: 0})


@pytest.mark.parametrize("name", ["seed", "block_clips", "max_latents"])
def test_these_numbers_of_an_order_are_not_negative(name):
    OrderConfig(**{name: 0})
    with pytest.raises(ValueError, match=f"{name} must not be negative, found -1"):
        OrderConfig(**{name: -1})


def test_rows_have_a_length_where_clips_are_joined_and_nowhere_else():
    OrderConfig(arrangement=Arrangement.JOIN, row_latents=16)
    for arrangement, row_latents in ((Arrangement.JOIN, 0), (Arrangement.PLAIN, 16), (Arrangement.BUCKET, 16)):
        with pytest.raises(ValueError, match="row_latents belongs to arrangement = join"):
            OrderConfig(arrangement=arrangement, row_latents=row_latents)


@pytest.mark.parametrize("sizes", [(), (0,), (2, -1)])
def test_chunks_have_at_least_one_latent(sizes):
    with pytest.raises(ValueError, match="chunk_sizes"):
        OrderConfig(chunk_sizes=sizes)


def test_a_loader_needs_nothing_but_sources():
    config = LoaderConfig(sources=(SourceConfig(release="release"),))
    assert (config.order, config.read, config.ledger) == (OrderConfig(), ReadConfig(), "")
