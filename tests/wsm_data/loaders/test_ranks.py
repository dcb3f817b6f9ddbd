import pytest
import torch.distributed

from wsm_data.loaders.ranks import place_among_ranks


def test_what_is_given_is_taken():
    assert place_among_ranks(2, 4) == (2, 4)


def test_alone_a_process_is_rank_0_of_1():
    assert place_among_ranks(None, None) == (0, 1)


def test_the_process_group_is_asked_where_there_is_one(tmp_path):
    torch.distributed.init_process_group("gloo", init_method=f"file://{tmp_path}/group", rank=0, world_size=1)
    try:
        assert place_among_ranks(None, None) == (0, 1)
        assert place_among_ranks(1, 3) == (1, 3)
    finally:
        torch.distributed.destroy_process_group()


@pytest.mark.parametrize("place", [(0, None), (None, 2)])
def test_one_without_the_other_is_a_bug_of_the_caller(place):
    with pytest.raises(ValueError, match="rank and world_size belong together"):
        place_among_ranks(*place)


@pytest.mark.parametrize("place", [(-1, 2), (2, 2), (0, 0)])
def test_a_rank_must_exist(place):
    with pytest.raises(ValueError, match="rank must lie in"):
        place_among_ranks(*place)
