"""Recipes: which stages, with which differences, wired into which folders."""

from pathlib import Path

import pytest

from pipelines.recipe import Recipe, load_recipe, recipe_names, recipe_summaries, stage_config, stage_sections
from pipelines.registry import STAGES, load_stage
from pipelines.running.settings import parse_assignments
from wsm_data.curation.split import SplitBy
from wsm_data.errors import ConfigError


@pytest.fixture
def recipe_file(tmp_path):
    def write(text):
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return str(path)

    return write


def test_the_recipes_of_the_project_can_be_read_and_every_section_is_that_of_a_stage_they_run():
    assert "demo" in recipe_names()
    for name in recipe_names():
        recipe = load_recipe(name, None, {})
        assert set(recipe.settings) <= set(recipe.stages)


def test_stages_run_in_the_order_of_the_flow_whatever_the_order_in_the_file(recipe_file):
    recipe = load_recipe(recipe_file('stages = ["split", "index"]'), None, {})
    assert recipe.stages == ("index", "split")


def test_a_file_and_set_are_laid_over_a_recipe_in_this_order(recipe_file, tmp_path):
    own = recipe_file('stages = ["index"]\nsource = "a"\n[index]\ndataset = "x"\ndepth_sample_every = 1')
    (tmp_path / "over.toml").write_text('source = "b"\n[index]\ndepth_sample_every = 2')
    recipe = load_recipe(own, tmp_path / "over.toml", parse_assignments(["source=1.10", "index.dataset=y"]))
    assert (recipe.source, recipe.settings) == ("1.10", {"index": {"dataset": "y", "depth_sample_every": 2}})


def test_stages_can_be_chosen_with_set(recipe_file):
    own = recipe_file('stages = ["index", "split", "map"]')
    assert load_recipe(own, None, parse_assignments(['stages=["index", "map"]'])).stages == ("index", "map")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('stages = ["indx"]', r"'indx' is not known; did you mean index\?"),
        ('stages = ["index"]\n[encod]\nx = 1', r"'encod' is not known; did you mean encode\?"),
        ('stages = ["index"]\nsorce = "x"', r"'sorce' is not known; did you mean source\?"),
        ('source = "x"', r"must list its stages: stages = \[synth, index,"),
        ("stages = []", "must list its stages"),
        ("stages = [1]", "stages takes text in quotes, found 1"),
        ('stages = ["index"]\nsource = 5', "source takes text in quotes, found 5"),
        ('stages = ["index"]\nindex = 5', "index is a section of settings, found the value 5"),
    ],
)
def test_what_a_recipe_does_not_know_is_refused(recipe_file, text, message):
    with pytest.raises(ConfigError, match=message):
        load_recipe(recipe_file(text), None, {})


def test_an_unknown_recipe_is_refused_with_the_nearest():
    with pytest.raises(ConfigError, match=r"there is no recipe 'dmo', and it is no TOML file; did you mean demo\?"):
        load_recipe("dmo", None, {})
    with pytest.raises(ConfigError, match=r"configuration file mine.toml does not exist"):
        load_recipe("mine.toml", None, {})


def test_sections_are_given_without_the_keys_of_a_recipe():
    values = {"stages": ["index"], "summary": "x", "split": {"seed": 1}}
    assert stage_sections(values, "here") == {"split": {"seed": 1}}


def test_input_fields_named_after_a_stage_are_that_stages_folder_in_the_run():
    recipe = Recipe(stages=("index", "split"), settings={"split": {"seed": 7}}, source="tree")
    config = stage_config(recipe, "split", Path("run"))
    assert (config.index, config.seed) == (Path("run/index"), 7)
    assert stage_config(recipe, "index", Path("run")).source == Path("tree")


def test_a_run_that_generates_its_data_reads_them_from_its_own_folder():
    recipe = Recipe(stages=("synth", "index"))
    assert stage_config(recipe, "index", Path("run")).source == Path("run/synth/tree")


def test_what_shows_a_release_decodes_it_with_the_weights_it_was_encoded_with():
    changes = parse_assignments(["source=tree", "encode.codec.weights=vae"])
    recipe = load_recipe("interndata_wan", None, changes)
    assert stage_config(recipe, "encode", Path("run")).codec.weights == "vae"
    assert stage_config(recipe, "report", Path("run")).weights == "vae"
    assert stage_config(recipe, "verify", Path("run")).release == "run/pack/release"
    assert stage_config(load_recipe("demo", None, {}), "report", Path("run")).weights == ""


def test_the_report_audits_the_split_by_what_was_dealt_as_a_whole():
    by_scene = load_recipe("demo", None, parse_assignments(["split.by=scene"]))
    assert stage_config(by_scene, "report", Path("run")).split_by is SplitBy.SCENE
    own = load_recipe("demo", None, parse_assignments(["split.by=scene", "report.split_by=trajectory"]))
    assert stage_config(own, "report", Path("run")).split_by is SplitBy.TRAJECTORY


def test_other_weights_may_be_given_to_the_report():
    recipe = load_recipe("interndata_wan", None, parse_assignments(["encode.codec.weights=a", "report.weights=b"]))
    assert stage_config(recipe, "report", Path("run")).weights == "b"


def test_a_codec_that_is_no_section_is_left_to_the_stage_that_owns_it():
    recipe = load_recipe("demo", None, parse_assignments(["encode.codec=wan"]))
    assert stage_config(recipe, "report", Path("run")).weights == ""
    with pytest.raises(ConfigError, match=r"encode\.codec is a section"):
        stage_config(recipe, "encode", Path("run"))


def test_every_recipe_says_in_a_line_what_it_is_for():
    assert list(recipe_summaries()) == list(recipe_names())
    assert all(summary and "\n" not in summary for summary in recipe_summaries().values())


def test_a_recipe_without_a_source_says_how_to_give_one():
    with pytest.raises(ConfigError, match="give it with --set source=PATH"):
        stage_config(Recipe(stages=("index",)), "index", Path("run"))


def test_the_source_may_also_be_given_to_the_stage_itself():
    recipe = Recipe(stages=("index",), settings={"index": {"source": "there"}})
    assert stage_config(recipe, "index", Path("run")).source == Path("there")


def test_every_stage_can_be_configured_from_a_recipe():
    recipe = Recipe(stages=tuple(entry.name for entry in STAGES), source="tree")
    for name in recipe.stages:
        assert type(stage_config(recipe, name, Path("run"))) is load_stage(name).config_type
