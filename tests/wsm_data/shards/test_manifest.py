import json
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.shards.manifest import manifest_bytes, parse_manifest, release_digest
from wsm_data.shards.names import MANIFEST_NAME


def test_a_manifest_comes_back_equal(tiny: SimpleNamespace) -> None:
    assert parse_manifest(manifest_bytes(tiny.manifest), "there") == tiny.manifest


def test_the_digest_of_a_release_is_that_of_its_file(tiny: SimpleNamespace) -> None:
    assert release_digest(tiny.manifest) == sha256_file(tiny.folder / MANIFEST_NAME)


def test_the_order_of_mappings_does_not_change_the_bytes(tiny: SimpleNamespace) -> None:
    turned = replace(tiny.manifest, clips_by_group=dict(reversed(tiny.manifest.clips_by_group.items())))
    assert manifest_bytes(turned) == manifest_bytes(tiny.manifest)


def test_a_number_that_json_does_not_have_is_a_bug(tiny: SimpleNamespace) -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        manifest_bytes(replace(tiny.manifest, codec_quality={"rgb_psnr_db": float("nan")}))


def test_another_schema_version_is_refused_with_both_numbers(tiny: SimpleNamespace) -> None:
    data = manifest_bytes(replace(tiny.manifest, schema_version=2))
    with pytest.raises(IntegrityError, match="schema_version must be 1, found 2"):
        parse_manifest(data, "there")


def test_a_shard_without_room_for_its_clips_is_refused_before_anything_is_taken_for_them(tiny: SimpleNamespace) -> None:
    record = json.loads(manifest_bytes(tiny.manifest))
    record["shards"][0]["clips"] = 10**9
    with pytest.raises(IntegrityError, match="cannot hold 1000000000 clips"):
        parse_manifest(json.dumps(record).encode(), "there")


def _changed(change: Callable[[dict[str, Any]], object]) -> Callable[[bytes], bytes]:
    def apply(data: bytes) -> bytes:
        record = json.loads(data)
        change(record)
        return json.dumps(record, sort_keys=True, indent=2).encode() + b"\n"

    return apply


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data.replace(b"CC0", b"CC1"),
        lambda data: data[:-1],
        lambda data: data.replace(b"\n", b"\r\n"),
        lambda data: b"[]",
        lambda data: b"\xff",
        _changed(lambda record: record.pop("clips")),
        _changed(lambda record: record.update(more=1)),
        _changed(lambda record: record["rgb_statistics"]["mean"].append(0.0)),
        _changed(lambda record: record["codec"].update(name="wan")),
        _changed(lambda record: record.pop("content_sha256")),
    ],
)
def test_a_manifest_changed_in_any_way_is_refused(tiny: SimpleNamespace, change: Callable[[bytes], bytes]) -> None:
    with pytest.raises(IntegrityError, match="there must be the manifest of a release"):
        parse_manifest(change(manifest_bytes(tiny.manifest)), "there")


@pytest.mark.parametrize("name", ["../train-000000.tar", "/etc/train-000000.tar", "a/train-000000.tar", "x.tar", "", 7])
def test_a_name_that_is_none_of_a_shard_is_refused_before_it_becomes_a_path(tiny: SimpleNamespace, name: Any) -> None:
    record = json.loads(manifest_bytes(tiny.manifest))
    record["shards"][0]["name"] = name
    with pytest.raises(IntegrityError, match="there must be the manifest of a release"):
        parse_manifest(json.dumps(record).encode(), "there")
    if isinstance(name, str):
        with pytest.raises(ValueError, match=r"a shard must have a name such as train-000000\.tar, found '"):
            replace(tiny.manifest.shards[0], name=name)


def test_the_documentation_lists_every_key(words_of_table: Callable[[str], list[str]], tiny: SimpleNamespace) -> None:
    assert sorted(words_of_table("## dataset.json")) == sorted(json.loads(manifest_bytes(tiny.manifest)))
