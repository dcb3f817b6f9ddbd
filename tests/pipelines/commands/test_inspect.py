from pathlib import Path

import pytest

from pipelines.cli import app


@pytest.mark.parametrize("option", ["--out", "--rerun"])
def test_a_picture_or_a_recording_of_no_clip_is_a_wrong_request(option, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        app(["inspect", str(tmp_path), option, str(tmp_path / "file")])
    assert stopped.value.code == 2
    assert "name it by its KEY" in capsys.readouterr().err
    assert list(Path(tmp_path).iterdir()) == []
