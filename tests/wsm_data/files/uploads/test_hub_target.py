"""Uploads to a data set repository: content first, one commit that shows it, compared with what the hub says it has."""

import pytest
from hub_server import TOKEN

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.uploads import hub_target
from wsm_data.files.uploads.hub_target import HubTarget
from wsm_data.files.uploads.local_file import look_at


@pytest.fixture
def target(hub):
    return HubTarget("hf://datasets/someone/homes/v1")


@pytest.fixture
def large(tmp_path):
    (tmp_path / "shard").write_bytes(bytes(range(256)) * 20)
    return look_at(tmp_path / "shard", 1 << 20)


@pytest.fixture
def small(tmp_path):
    (tmp_path / "index").write_bytes(b"index")
    return look_at(tmp_path / "index", 1 << 20)


def test_files_are_seen_after_the_commit_and_not_before(target, large, small, hub):
    target.put("shard", large)
    target.put("index", small)
    assert not target.holds("shard", large)
    assert hub.commits == []
    target.settle()
    assert hub.commits == [["v1/shard", "v1/index"]]
    assert target.holds("shard", large)
    assert target.holds("index", small)
    assert target.store.read("shard") == large.path.read_bytes()
    assert target.store.names() == ["index", "shard"]


def test_the_hub_names_large_files_by_sha256_and_small_ones_as_git_does(target, large, small):
    target.put("shard", large)
    target.put("index", small)
    target.settle()
    assert target.checksum("shard") == f"hub:{large.sha256}"
    assert target.checksum("index") == f"hub:{small.git_sha1}"
    assert target.checksum("absent") == ""


def test_content_that_was_uploaded_before_a_kill_is_not_uploaded_again(target, large, hub):
    target.put("shard", large)
    again = HubTarget("hf://datasets/someone/homes/v1")
    again.put("shard", large)
    again.settle()
    assert hub.uploads() == 1
    assert again.holds("shard", large)


def test_a_busy_hub_is_asked_again(target, large, hub):
    hub.fail("POST .*/commit/", 1)
    hub.fail("POST .*/paths-info/", 2)
    target.put("shard", large)
    target.settle()
    assert target.holds("shard", large)


def test_a_card_is_put_to_a_server_that_cannot_say_whether_its_head_is_valid(target, tmp_path, hub):
    """huggingface_hub asks `validate-yaml` before a commit of README.md, which the stand-in answers by 404."""
    (tmp_path / "README.md").write_text("---\nlicense: apache-2.0\n---\n")
    card = look_at(tmp_path / "README.md", 1 << 20)
    root = HubTarget("hf://datasets/someone/homes")
    root.put("README.md", card)
    root.settle()
    assert root.holds("README.md", card)
    assert not any("validate-yaml" in one for one in hub.requests)


def test_what_is_removed_is_gone_with_the_next_commit(target, small, hub):
    target.put("index", small)
    target.settle()
    target.remove("index")
    target.remove("absent")
    target.settle()
    assert hub.commits[-1] == ["v1/index"]
    assert not target.store.exists("index")


def test_nothing_to_settle_is_no_commit(target, hub):
    target.settle()
    assert hub.requests == []


def test_a_refusal_names_the_file_and_never_the_token(target, large, hub):
    hub.token = f"{TOKEN}-of-others"
    with pytest.raises(StoreError, match="someone/homes") as refused:
        target.put("shard", large)
    assert TOKEN not in str(refused.value)


def test_what_the_hub_has_afterwards_must_be_what_was_sent(target, small, hub, monkeypatch):
    target.put("index", small)
    monkeypatch.setattr(hub_target, "_digest", lambda stated: "other")
    with pytest.raises(StoreError, match="must be the file"):
        target.settle()


@pytest.mark.parametrize("url", ["hf://someone/model", "hf://datasets/someone", "hf://datasets//name", "hf://"])
def test_a_url_that_names_no_data_set_is_refused(url):
    with pytest.raises(ConfigError, match="hf://datasets/NAMESPACE/NAME"):
        HubTarget(url)
