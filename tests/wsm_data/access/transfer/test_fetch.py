"""A fetched release is the published one to the byte, whatever happened on the way."""

import pytest
from tiny_release import build_clip, pack

from wsm_data.access.transfer import fetch as module
from wsm_data.access.transfer.fetch import fetch_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.stores import open_store
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.shards.names import MANIFEST_NAME


@pytest.fixture
def url(publish, memory_url):
    publish(memory_url)
    return memory_url


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "fetched"


def fetch(url, folder):
    return fetch_release(url, folder, 2, lambda count: None)


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", ["memory", "s3", "hub"])
def test_what_comes_back_is_what_went(kind, publish, memory_url, tiny, folder, request):
    url = memory_url
    if kind == "s3":
        url = f"{request.getfixturevalue('bucket')[0]}/release"
    elif kind == "hub":
        request.getfixturevalue("hub")
        url = "hf://datasets/someone/homes"
    publish(url)
    fetch(url, folder)
    assert contents(folder) == contents(tiny.folder)


def test_a_second_call_brings_only_the_manifest(url, folder):
    first = fetch(url, folder)
    assert first.moved_files == first.files
    assert fetch(url, folder).moved_files == 1


def test_a_cut_file_goes_on_where_it_ends(url, folder, tiny, monkeypatch):
    monkeypatch.setattr(module, "_PART_BYTES", 1000)
    shard = tiny.manifest.shards[0]
    folder.mkdir()
    (folder / f".{shard.name}.arriving").write_bytes((tiny.folder / shard.name).read_bytes()[:5000])
    asked = []
    read_range = FsspecStore.read_range

    def watching(self, name, offset, size):
        asked.append((name, offset))
        return read_range(self, name, offset, size)

    monkeypatch.setattr(FsspecStore, "read_range", watching)
    fetch(url, folder)
    assert min(offset for name, offset in asked if name == shard.name) == 5000
    assert verify_release(folder) == []


def test_a_wrong_beginning_is_thrown_away(url, folder, tiny):
    folder.mkdir()
    shard = tiny.manifest.shards[0].name
    (folder / f".{shard}.arriving").write_bytes(b"x" * 5000)
    fetch(url, folder)
    assert contents(folder) == contents(tiny.folder)


def test_killed_at_any_piece_there_is_no_release_and_the_next_call_completes_it(url, folder, tiny, monkeypatch):
    monkeypatch.setattr(module, "_PART_BYTES", 20_000)
    read_range = FsspecStore.read_range
    for survived in range(0, 12, 3):
        left = [survived]

        def dying(self, name, offset, size, left=left):
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            return read_range(self, name, offset, size)

        monkeypatch.setattr(FsspecStore, "read_range", dying)
        with pytest.raises(KeyboardInterrupt):
            fetch(url, folder / str(survived))
        assert not (folder / str(survived) / MANIFEST_NAME).exists()
        monkeypatch.setattr(FsspecStore, "read_range", read_range)
        fetch(url, folder / str(survived))
        assert contents(folder / str(survived)) == contents(tiny.folder)


def test_damage_in_the_store_is_named_and_never_becomes_a_release(url, folder, tiny, tmp_path):
    shard = tiny.manifest.shards[0]
    FsspecTarget(open_store(url)).store.put_file(shard.name, _damaged(tiny.folder / shard.name, tmp_path))
    with pytest.raises(IntegrityError, match=f"{shard.name} must have sha256"):
        fetch(url, folder)
    assert not (folder / MANIFEST_NAME).exists()


def _damaged(path, tmp_path):
    data = path.read_bytes()
    (tmp_path / "damaged").write_bytes(data[:600] + b"\xff" + data[601:])
    return tmp_path / "damaged"


def test_shards_of_another_release_in_the_folder_are_removed(url, folder, tiny):
    pack(folder, [build_clip("synth_d435i/home_0009/000001")], shard_bytes=100)
    (folder / "train-000099.tar").write_bytes(b"left over")
    fetch(url, folder)
    assert contents(folder) == contents(tiny.folder)


def test_a_folder_of_other_things_is_left_alone(url, folder):
    folder.mkdir()
    (folder / "thesis.tex").write_text("mine")
    with pytest.raises(ConfigError, match="must be empty or hold a release"):
        fetch(url, folder)


def test_a_url_without_a_release_is_said_so(folder, tmp_path):
    with pytest.raises(ConfigError, match="there is no release at memory://absent"):
        fetch("memory://absent", folder)
    assert not folder.exists()
