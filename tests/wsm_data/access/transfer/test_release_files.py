"""The files of a release are those that its manifest vouches for, and what is attached to it."""

import pytest

from wsm_data.access.transfer.release_files import release_files
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.files.stores import open_store
from wsm_data.shards.manifest import release_digest


def test_every_file_of_the_folder_is_named_once_with_its_digest(tiny):
    files = release_files(open_store(tiny.folder))
    beside = {path.name for path in tiny.folder.iterdir()} - {"dataset.json"}
    assert {name: sha256_file(tiny.folder / name) for name in beside} == dict(files.vouched)
    assert (files.attached, files.digest) == ((), release_digest(tiny.manifest))


def test_scores_and_selections_are_attached(tiny):
    (tiny.folder / "scores.parquet").touch()
    (tiny.folder / "selections").mkdir()
    (tiny.folder / "selections" / "hard.parquet").touch()
    files = release_files(open_store(tiny.folder))
    assert files.attached == ("scores.parquet", "selections/hard.parquet")


def test_a_changed_manifest_is_none(tiny):
    manifest = tiny.folder / "dataset.json"
    manifest.write_bytes(manifest.read_bytes().replace(b'"clips"', b'"klips"'))
    with pytest.raises(IntegrityError):
        release_files(open_store(tiny.folder))
