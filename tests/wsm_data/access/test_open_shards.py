"""The reader that place and settings of a release ask for; a release behind a URL answers like one in a folder."""

import re

import pytest
from fault_proxy import Fault
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.cached_shards import CachedShards
from wsm_data.access.clip_reader import MAX_READS
from wsm_data.access.config import AccessConfig, RemoteAccess
from wsm_data.access.local_shards import LocalShards
from wsm_data.access.open_shards import open_shards
from wsm_data.access.ranges import RangeReader
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import IntegrityError, StoreError

TRANSIENT = (Fault.SLOW_DOWN, Fault.RESET, Fault.CUT_BODY, Fault.SHORT_BODY)


@pytest.mark.parametrize("access", list(RemoteAccess))
def test_a_folder_is_read_where_it_lies(published, access):
    release = open_release(published.folder)
    reader = open_shards(release.store, release.manifest, AccessConfig(access=access))
    reader.close()
    assert type(reader) is LocalShards


def test_ranges_are_read_unless_the_settings_ask_for_whole_shards(remote, tmp_path):
    release = open_release(remote.url)
    for access, kind in ((RemoteAccess.RANGES, RangeReader), (RemoteAccess.SHARDS, CachedShards)):
        config = remote.read(access=access, cache_dir=str(tmp_path))
        reader = open_shards(release.store, release.manifest, config)
        reader.close()
        assert type(reader) is kind


def test_a_release_behind_a_url_has_the_clips_of_the_folder(remote, published):
    local, far = open_release(published.folder), open_release(remote.url)
    assert far.manifest == local.manifest
    key = local.index.texts("key")[7]
    assert far.read_clip(key).rgb_latent.tobytes() == local.read_clip(key).rgb_latent.tobytes()


def test_a_clip_that_was_damaged_on_the_way_is_read_again_and_named_where_it_stays_damaged(remote, published):
    local, far = open_release(published.folder), open_release(remote.url)
    row = local.index.row_at(7)
    remote.proxy.spoil(row.shard, Fault.WRONG_BYTES)
    assert far.read_clip_bytes(row.key) == local.read_clip_bytes(row.key)
    assert remote.proxy.spoiled() == 1
    remote.proxy.spoil(row.shard, Fault.WRONG_BYTES, MAX_READS)
    with pytest.raises(IntegrityError, match=rf"{row.shard}, clip {row.key}: the .* of \w+\.\w+"):
        far.read_row(row)


def test_opening_gets_over_faults_that_pass(remote, published):
    for name in ("dataset.json", "index.parquet"):
        for fault in TRANSIENT:
            remote.proxy.spoil(name, fault)
    assert len(open_release(remote.url).index) == len(published.spans)
    assert remote.proxy.spoiled() == 2 * len(TRANSIENT)


@pytest.mark.parametrize("name", ["dataset.json", "index.parquet"])
def test_opening_names_what_cannot_be_read_or_is_not_what_was_written(remote, name):
    remote.proxy.spoil(name, Fault.FORBIDDEN)
    with pytest.raises(StoreError, match=f"{remote.url}/{name}: the store refuses"):
        open_release(remote.url)
    remote.proxy.spoil(name, Fault.WRONG_BYTES)
    with pytest.raises(IntegrityError, match=f"{remote.url}/{name}"):
        open_release(remote.url)


def test_a_release_behind_a_url_is_verified_through_faults(remote):
    for fault in TRANSIENT:
        remote.proxy.spoil(r"\.tar", fault)
    assert verify_release(remote.url) == []
    assert remote.proxy.spoiled() == len(TRANSIENT)


def test_the_commands_take_a_url(remote, published):
    inspected = CliRunner().invoke(app, ["inspect", remote.url])
    assert inspected.exit_code == 0
    assert re.search(rf"clips +{len(published.spans)}\n", inspected.output)
    verified = CliRunner().invoke(app, ["verify", remote.url])
    assert verified.exit_code == 0
    assert f"{remote.url} is whole" in verified.output


def test_a_store_that_refuses_has_an_exit_code_and_a_message_of_its_own(remote):
    remote.proxy.spoil("dataset.json", Fault.FORBIDDEN)
    refused = CliRunner().invoke(app, ["inspect", remote.url])
    assert refused.exit_code == StoreError.exit_code
    assert f"{remote.url}/dataset.json: the store refuses" in refused.output
