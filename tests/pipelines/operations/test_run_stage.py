"""`wsm STAGE`: settings of one stage."""

import pytest
from fake_stages import COPY, JOIN

from pipelines import recipe
from pipelines.operations.run_stage import stage_settings
from pipelines.running.options import StageRequest
from wsm_data.errors import ConfigError


@pytest.fixture(autouse=True)
def fake_names(monkeypatch):
    monkeypatch.setattr(recipe, "_NAMES", ("copy", "join"))


def test_settings_come_from_the_file_and_then_from_set(tmp_path):
    (tmp_path / "my.toml").write_text('[copy]\nsource = "a"\nrepeat = 3\n')
    request = StageRequest(config=tmp_path / "my.toml", assignments=("repeat=2",))
    settings = stage_settings(COPY, request)
    assert (settings.source.name, settings.repeat) == ("a", 2)


def test_all_missing_inputs_of_a_stage_are_named_at_once():
    with pytest.raises(ConfigError, match=r"`wsm join` must know where its inputs are: add --set copy=FOLDER$"):
        stage_settings(JOIN, StageRequest())


def test_a_key_that_is_misspelt_is_named_before_a_missing_input():
    with pytest.raises(ConfigError, match="unknown key cpoy; did you mean copy"):
        stage_settings(JOIN, StageRequest(assignments=("cpoy=x",)))
