import json

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.settings import settings_by_command, show_settings
from pipelines.registry import STAGES, load_stage
from pipelines.running.described_settings import REQUIRED, SECTION
from pipelines.running.settings import parse_assignments
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import build_config


@pytest.fixture(scope="module")
def described():
    return settings_by_command()


def test_every_stage_and_training_is_described(described):
    assert list(described) == [*(entry.name for entry in STAGES), "train", "posttrain"]


def test_every_setting_has_a_meaning(described):
    silent = [f"{name}: {one.name}" for name, settings in described.items() for one in settings if not one.meaning]
    assert silent == []


@pytest.mark.parametrize("stage", [entry.name for entry in STAGES])
def test_the_printed_defaults_given_as_settings_are_the_defaults(described, stage):
    """Those below NAME are of a section that is not there by default."""
    words = [(one.name, one.default) for one in described[stage] if one.type != SECTION and ".NAME." not in one.name]
    needed = [f"{name}=somewhere" for name, default in words if default == REQUIRED]
    given = [f"{name}={default}" for name, default in words if default != REQUIRED]
    config_type = load_stage(stage).config_type
    assert build_config(config_type, parse_assignments(needed + given)) == build_config(
        config_type, parse_assignments(needed)
    )


def test_json_holds_the_settings_of_the_stage_that_is_asked_for(capsys):
    show_settings("encode", as_json=True, as_markdown=False)
    said = json.loads(capsys.readouterr().out)
    assert list(said) == ["encode"]
    width = {"name": "clip.width", "type": "whole number", "default": "320", "meaning": "encoded width, px (table 4)."}
    assert width in said["encode"]


def test_text_names_type_default_and_meaning(capsys):
    show_settings("split", as_json=False, as_markdown=False)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == ["split: settings", "  index (path, required)", "      folder of `wsm index`."]
    assert "  test_fraction (number, default 0.05)" in lines


@pytest.mark.parametrize(("word", "near"), [("indx", "index"), ("training", "train")])
def test_an_unknown_stage_is_refused_with_the_nearest_name(word, near):
    with pytest.raises(ConfigError, match=f"there is no stage '{word}'; did you mean {near}\\?"):
        settings_by_command(word)


def test_two_forms_at_once_are_refused():
    with pytest.raises(ConfigError, match="give one of them"):
        show_settings(None, as_json=True, as_markdown=True)


def test_the_command_prints_what_the_operation_does(capsys):
    show_settings("map", as_json=False, as_markdown=False)
    assert CliRunner().invoke(app, ["settings", "map"]).output == capsys.readouterr().out
