"""`wsm retry`: what was refused for a reason is tried again with the settings of the run, and so is what follows."""

import pytest

from pipelines.operations.runs.retry import retry
from pipelines.running.options import RunOptions, StageRequest
from wsm_data.errors import ConfigError

REQUEST = StageRequest(options=RunOptions(quiet=True, max_refused=100))


@pytest.fixture
def folder(run, source, tmp_path):
    """A run of which one unit is refused, and of another a part."""
    (source / "a2.txt").write_text("bad")
    (source / "b1.txt").write_text("partly bad")
    run()
    return tmp_path / "run"


def test_units_that_were_refused_so_are_tried_again_and_no_others(folder, calls):
    retry(folder, ["frame.empty"], REQUEST)
    assert calls() == ["a2", "finish"]


def test_a_unit_of_which_a_part_was_refused_so_is_done_again(folder, calls):
    retry(folder, ["frame.missing"], REQUEST)
    assert calls() == ["b1", "finish"]


def test_what_can_be_used_by_now_goes_on_through_the_run(folder, source, calls, capsys):
    (source / "a2.txt").write_text("mended")
    retry(folder, ["frame.empty"], REQUEST)
    assert (folder / "join" / "a2").read_text() == "mended!"
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()[:3]] == ["stage", "copy", "join"]


def test_a_reason_for_which_nothing_was_refused_is_told_with_those_there_are(folder):
    with pytest.raises(ConfigError, match=r"refused for pose\.jump; what was refused was so for frame\.empty, frame"):
        retry(folder, ["pose.jump"], REQUEST)


def test_what_is_no_reason_code_is_told_with_the_nearest(folder):
    with pytest.raises(ConfigError, match=r"'frame\.emty' is no reason code; .*frame\.empty"):
        retry(folder, ["frame.emty"], REQUEST)


def test_a_folder_of_no_run_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="must be the folder of a run"):
        retry(tmp_path, ["pose.jump"], REQUEST)
