import json
import shutil
from pathlib import Path

import mlcroissant
import pytest
from tiny_release import CODEC, build_clip, pack

from wsm_data.access.release import Release, open_release
from wsm_data.access.transfer.croissant import CROISSANT_NAME, croissant
from wsm_data.files.digest import sha256_file
from wsm_data.shards.index.row import SCHEMA


@pytest.fixture(scope="module")
def release(tmp_path_factory) -> Release:
    folder = tmp_path_factory.mktemp("croissant") / "release"
    pack(folder, [build_clip(f"g_d435i/s/{number:06d}") for number in range(3)], shard_bytes=1 << 20, codec=CODEC)
    return open_release(folder)


@pytest.fixture(scope="module")
def described(release, tmp_path_factory) -> mlcroissant.Dataset:
    """As the reference implementation reads it, beside the files; it raises where anything is invalid."""
    folder = tmp_path_factory.mktemp("published")
    shutil.copytree(release.store.root, folder, dirs_exist_ok=True)
    (folder / CROISSANT_NAME).write_text(croissant(release))
    return mlcroissant.Dataset(folder / CROISSANT_NAME)


def test_the_reference_implementation_finds_no_error_and_misses_only_what_a_release_does_not_have(described):
    issues = described.metadata.ctx.issues
    assert list(issues.errors) == []
    missed = {name for name in ("citeAs", "datePublished", "version", "license") if name in issues.report()}
    assert missed >= {"citeAs", "datePublished", "version"}
    assert len(issues.warnings) == len(missed)


def test_every_file_is_named_with_its_checksum(release):
    files = json.loads(croissant(release))["distribution"]
    assert [one["name"] for one in files] == ["index.parquet", *(shard.name for shard in release.manifest.shards)]
    for one in files:
        assert one["sha256"] == sha256_file(Path(release.store.root) / one["contentUrl"])


def test_the_records_are_the_rows_of_the_index(described, release):
    records = list(described.records("clips"))
    assert [record["clips/key"].decode() for record in records] == release.index.texts("key")
    assert [record["clips/frames"] for record in records] == release.index.numbers("frames").tolist()
    assert {name.removeprefix("clips/") for name in records[0]} == set(SCHEMA.names)


def test_equal_releases_have_equal_texts(release):
    assert croissant(release) == croissant(open_release(release.store.root))
