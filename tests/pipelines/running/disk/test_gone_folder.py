"""A folder that is deleted while a stage works is named in a sentence; a file that is not found elsewhere is a bug."""

import shutil
from dataclasses import replace

import pytest
from fake_stages import COPY

from pipelines.running.disk.gone_folder import gone_folder_named
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.errors import WsmError


def deleting(folder):
    """The copying stage, which deletes a folder before its second unit."""

    def process(batch, config, context):
        for unit in batch:
            if unit.id == "a2":
                shutil.rmtree(folder)
            yield from COPY.process([unit], config, context)

    return replace(COPY, process=process)


def test_a_source_or_a_run_that_is_deleted_while_a_stage_works_is_named(config, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(WsmError, match=rf"^{config.source} is gone, .*and was there when the command began"):
        run_stage(deleting(config.source), config, out, RunOptions(quiet=True))


def test_the_run_folder_is_named_too(config, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(WsmError, match=rf"^{out} is gone"):
        run_stage(deleting(out), config, out, RunOptions(quiet=True))
    run_stage(COPY, config, out, RunOptions(quiet=True))
    assert sorted(path.name for path in (out / "copies").iterdir()) == ["a1.txt", "a2.txt", "b1.txt"]


def test_a_file_that_is_not_found_in_folders_that_are_there_stays_what_it_is(config, tmp_path):
    with pytest.raises(FileNotFoundError), gone_folder_named(config, tmp_path):
        raise FileNotFoundError("x")
