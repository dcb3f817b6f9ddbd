"""Nothing outside the folders that a command is given must be writable."""

import os
import stat
import tempfile
from pathlib import Path

import pytest

from wsm_data.files import kernel_cache
from wsm_data.files.kernel_cache import VARIABLE, settle_kernel_cache


@pytest.fixture(autouse=True)
def nowhere(tmp_path, monkeypatch):
    """Neither the package nor the home can be written, the temporary folder can, even for root."""
    monkeypatch.setenv(VARIABLE, "undone at the end")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", "/proc/no_home")
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    writable = os.access
    monkeypatch.setattr(
        kernel_cache.os, "access", lambda path, mode: "package" not in str(path) and writable(path, mode)
    )


def test_without_a_writable_home_kernels_go_to_a_folder_of_the_user_alone(tmp_path):
    settle_kernel_cache(tmp_path / "package")
    folder = Path(os.environ[VARIABLE])
    assert folder.parent == tmp_path / "tmp"
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    del os.environ[VARIABLE]
    settle_kernel_cache(tmp_path / "package")
    assert Path(os.environ[VARIABLE]) == folder, "the next command finds what this one compiled"


def test_a_folder_that_others_may_write_is_not_trusted(tmp_path):
    planted = tmp_path / "tmp" / f"wsm-kernels-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    settle_kernel_cache(tmp_path / "package")
    folder = Path(os.environ[VARIABLE])
    assert folder != planted
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_a_link_in_its_place_is_not_followed(tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    (tmp_path / "tmp" / f"wsm-kernels-{os.getuid()}").symlink_to(tmp_path / "elsewhere")
    settle_kernel_cache(tmp_path / "package")
    assert not Path(os.environ[VARIABLE]).samefile(tmp_path / "elsewhere")


@pytest.mark.parametrize("place", ["package", "home", "variable"])
def test_where_numba_finds_a_place_by_itself_nothing_is_set(tmp_path, monkeypatch, place):
    monkeypatch.setattr(kernel_cache.os, "access", lambda path, _mode: place in str(path))
    if place == "home":
        monkeypatch.setenv("HOME", str(tmp_path / "home"))
    if place == "variable":
        monkeypatch.setenv(VARIABLE, "/chosen")
    settle_kernel_cache(tmp_path / "package")
    assert os.environ.get(VARIABLE) == ("/chosen" if place == "variable" else None)
