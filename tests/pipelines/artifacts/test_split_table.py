import pytest

from pipelines.artifacts.split_table import SPLIT_FILE, read_split, write_split
from wsm_data.errors import IntegrityError
from wsm_data.schema.identity import EpisodeId


def test_splits_come_back_by_id_in_the_order_they_were_written(tmp_path):
    splits = {
        EpisodeId("box_zed", "hall", name): side for name, side in (("2", "test"), ("1", "train"), ("3", "train"))
    }
    write_split(tmp_path, splits)
    assert list(read_split(tmp_path).items()) == [
        ("box_zed/hall/2", "test"),
        ("box_zed/hall/1", "train"),
        ("box_zed/hall/3", "train"),
    ]


def test_nothing_to_deal_is_an_empty_table(tmp_path):
    write_split(tmp_path, {})
    assert (tmp_path / SPLIT_FILE).read_bytes() == b""
    assert read_split(tmp_path) == {}


def test_a_table_that_is_gone_is_not_taken_for_an_empty_one(tmp_path):
    with pytest.raises(IntegrityError, match=r"split\.jsonl is missing; run `wsm split` again"):
        read_split(tmp_path)


@pytest.mark.parametrize(
    "line", ['{"id": "a/b/1"}', '{"id": "a/b/1", "split": 1}', '{"id": "a/b/1", "split": "test", "x": 1}']
)
def test_a_line_that_is_no_row_is_damage(tmp_path, line):
    (tmp_path / SPLIT_FILE).write_text(line + "\n")
    with pytest.raises(IntegrityError, match=r"split\.jsonl:1 must hold the split of a trajectory, but: .*wsm split"):
        read_split(tmp_path)
