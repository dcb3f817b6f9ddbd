"""A folder behind a URL comes back to the byte, and is none while it is not whole."""

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.files.stores import open_store
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.files.uploads.mirror import MIRROR_NAME, bring_folder, send_folder

FILES = {"stage.json": b"{}", "a.txt": b"one", "sub/deep/b.bin": bytes(1000), "release/dataset.json": b"last"}


@pytest.fixture
def folder(tmp_path):
    for name, data in FILES.items():
        path = tmp_path / "here" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    (tmp_path / "here" / ".lock").touch()
    return tmp_path / "here"


@pytest.fixture(params=["memory", "s3"])
def url(request, tmp_path):
    if request.param == "s3":
        return f"{request.getfixturevalue('bucket')[0]}/run/stage"
    return f"memory://mirror-{tmp_path.name}"


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_all_but_hidden_files_go_and_come_back(folder, url, tmp_path):
    assert send_folder(folder, url) == len(FILES)
    assert bring_folder(url, tmp_path / "there") == len(FILES)
    assert contents(tmp_path / "there") == FILES


def test_only_what_changed_is_sent_and_what_is_gone_is_removed(folder, url, tmp_path):
    send_folder(folder, url)
    assert send_folder(folder, url) == 0
    (folder / "a.txt").write_bytes(b"two")
    (folder / "sub/deep/b.bin").unlink()
    assert send_folder(folder, url) == 1
    bring_folder(url, tmp_path / "there")
    left = {name: data for name, data in FILES.items() if name != "sub/deep/b.bin"}
    assert contents(tmp_path / "there") == {**left, "a.txt": b"two"}
    assert not open_store(url).exists("sub/deep/b.bin")


def test_signs_of_being_whole_go_up_after_all_else(folder, tmp_path, monkeypatch):
    order = []
    put = FsspecTarget.put
    monkeypatch.setattr(FsspecTarget, "put", lambda self, name, file: (order.append(name), put(self, name, file)))
    send_folder(folder, f"memory://order-{tmp_path.name}", ("dataset.json", "stage.json"))
    assert order[-3:] == ["release/dataset.json", "stage.json", MIRROR_NAME]


def test_killed_between_there_is_nothing_to_bring(folder, tmp_path, monkeypatch):
    url = f"memory://killed-{tmp_path.name}"
    send_folder(folder, url)
    (folder / "a.txt").write_bytes(b"two")

    def dying(self, name, file):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(FsspecTarget, "put", dying)
        with pytest.raises(KeyboardInterrupt):
            send_folder(folder, url)
    assert bring_folder(url, tmp_path / "there") == 0
    assert send_folder(folder, url) == 1


def test_damage_in_the_store_is_named(folder, tmp_path):
    url = f"memory://damaged-{tmp_path.name}"
    send_folder(folder, url)
    (tmp_path / "other").write_bytes(b"two")
    FsspecTarget(open_store(url)).store.put_file("a.txt", tmp_path / "other")
    with pytest.raises(IntegrityError, match=r"a\.txt must have sha256"):
        bring_folder(url, tmp_path / "there")
    assert not (tmp_path / "there" / "a.txt").exists()
