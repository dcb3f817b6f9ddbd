"""A folder of exported sequences belongs to one release."""

import json

import pytest

from pipelines.operations.clips.export_tum import export_tum
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError


def test_more_clips_of_the_same_release_go_on_in_its_folder(homes_release, tmp_path, capsys):
    release = open_release(homes_release)
    for limit in (1, 2):
        export_tum(str(homes_release), tmp_path, "", limit, "")
        assert capsys.readouterr().out == f"{limit} of {len(release)} clips: {tmp_path}\n"
    folders = {path.name for path in tmp_path.iterdir() if path.is_dir()}
    assert folders == {key.replace("/", ".") for key in release.keys()[:2]}
    assert json.loads((tmp_path / "release.json").read_text())["release"] == release.digest


@pytest.mark.parametrize(("name", "text"), [("release.json", '{"release":"0"}\n'), ("notes.txt", "mine")])
def test_a_folder_of_anything_else_is_refused_and_left_as_it_was(homes_release, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(ConfigError, match="must be empty, or hold sequences of the release"):
        export_tum(str(homes_release), tmp_path, "", 1, "")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {name: text}
