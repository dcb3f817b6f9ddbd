import json
import sys
from pathlib import Path

import pytest

from wsm_data.access.transfer.card import dataset_card, shard_features
from wsm_data.schema.clip import MEMBERS

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

from walled_release import UNITS, build_release


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    return build_release(tmp_path_factory.mktemp("card"), UNITS)


def test_the_head_names_shards_and_columns_and_the_text_counts_and_licences(release):
    _, head, text = dataset_card(release).split("---\n")
    said = {name: json.loads(value) for name, _, value in (line.partition(": ") for line in head.splitlines())}
    assert said["configs"][0]["data_files"] == [
        {"split": "test", "path": "test-*.tar"},
        {"split": "train", "path": "train-*.tar"},
    ]
    assert said["dataset_info"]["features"] == shard_features()
    assert "6 clips (3 test, 3 train)" in text
    assert "licence of synthetic: CC0-1.0" in text
    assert release.digest in text


def test_columns_are_the_members_and_the_fields_of_stored_meta_data(release):
    columns = {one["name"]: one for one in shard_features()}
    assert list(columns) == [*(f"{name}.npy" for name in MEMBERS), "meta.json", "__key__", "__url__"]
    assert columns["poses.npy"]["list"] == {"list": "float32"}
    meta = json.loads(bytes(release.read_member(release.index.row_at(0), "meta")))
    struct = {one["name"]: one for one in columns["meta.json"]["struct"]}
    assert list(struct) == list(meta)
    assert struct["notes"] == {"name": "notes", "list": "string"}
    assert struct["T_world_camera0"] == {"name": "T_world_camera0", "list": {"list": "float64"}}


def test_the_library_datasets_takes_the_columns(release):
    datasets = pytest.importorskip("datasets", reason="the package datasets is not installed")
    features = datasets.Features._from_yaml_list(shard_features())
    files = {"train": f"{release.store.root}/train-*.tar"}
    table = datasets.load_dataset("webdataset", data_files=files, split="train", features=features)
    assert sorted(row["meta.json"]["key"] for row in table) == sorted(release.keys(split="train"))
