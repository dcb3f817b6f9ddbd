import pytest

from wsm_data.shards.names import is_shard_name, shard_name


def test_a_shard_is_named_by_its_split_and_a_six_digit_number() -> None:
    assert shard_name("train", 0) == "train-000000.tar"


def test_every_shard_name_is_recognised_also_beyond_six_digits() -> None:
    assert is_shard_name(shard_name("val_2", 12))
    assert is_shard_name(shard_name("train", 1_234_567))


@pytest.mark.parametrize(
    "name", ["notes.tar", "train-1.tar", "train-000000.tar.bak", "../train-000000.tar", "dataset.json"]
)
def test_other_files_are_no_shards(name: str) -> None:
    assert not is_shard_name(name)


@pytest.mark.parametrize("split", ["", "Train", "a/b", "a-b", "1st"])
def test_a_split_that_would_not_be_recognised_is_refused(split: str) -> None:
    with pytest.raises(ValueError, match="split must be a word"):
        shard_name(split, 0)
