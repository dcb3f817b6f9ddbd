import pytest
from box_room import along_x

from pipelines.artifacts.split_table import read_split
from pipelines.stages.index import SameContent
from pipelines.stages.split import SplitConfig
from wsm_data.curation.split import SplitBy, leaking_scenes, split_together
from wsm_data.errors import ConfigError
from wsm_data.files.digest import sha256_file
from wsm_data.files.typed_toml import build_config
from wsm_data.schema.identity import EpisodeId

ZED, D435I = "box_zed/hall", "box_d435i/hall"
IDS = [f"{scene}/{number:06d}" for scene in (D435I, ZED) for number in range(3)]


def short(count, from_y_m):
    """Short drives beside one another, no two alike."""
    return {number: along_x(y_m=from_y_m + 0.02 * number, frames=5) for number in range(count)}


def own_sides(names, by, seed):
    """Sides of trajectories as if the content of each were there once."""
    sides = split_together({EpisodeId.parse(name): name for name in names}, by, 0.5, seed)
    return {episode.text: side for episode, side in sides.items()}


@pytest.fixture
def indexed(make_pipeline):
    """Three short trajectories of one physical scene under each of two cameras."""
    pipeline = make_pipeline({D435I: (short(3, from_y_m=0.8), True), ZED: (short(3, from_y_m=1.0), True)})
    pipeline.run("index")
    return pipeline


def test_every_accepted_trajectory_gets_the_side_its_name_says(indexed):
    indexed.run("split", test_fraction=0.5, seed=3)
    wanted = own_sides(IDS, SplitBy.TRAJECTORY, 3)
    assert read_split(indexed.folder("split")) == wanted
    assert set(wanted.values()) == {"train", "test"}


def test_a_trajectory_that_comes_later_moves_no_other(indexed):
    indexed.run("split", test_fraction=0.5)
    before = read_split(indexed.folder("split"))
    indexed.write("box_d435i/den", short(4, from_y_m=2.4))
    indexed.run("index")
    assert indexed.run("split", test_fraction=0.5).ran == ("split",)
    after = read_split(indexed.folder("split"))
    assert len(after) == len(before) + 4
    assert {name: after[name] for name in before} == before


def test_names_alone_are_its_input(indexed, changed):
    before = indexed.inputs("split")
    indexed.write(D435I, short(3, from_y_m=1.2))
    indexed.run("index")
    assert changed(before, indexed.inputs("split")) == {}
    indexed.write("box_d435i/den", short(1, from_y_m=2.4))
    indexed.run("index")
    assert changed(before, indexed.inputs("split")) == {"split": {"episodes"}}


@pytest.mark.parametrize("seed", range(3))
def test_the_facts_say_how_many_test_scenes_are_trained_on_as_well(indexed, seed):
    report = indexed.run("split", test_fraction=0.5, seed=seed)
    splits = {EpisodeId.parse(name): side for name, side in read_split(indexed.folder("split")).items()}
    tests = [one for one, side in splits.items() if side == "test"]
    assert report.facts == {
        "train": len(splits) - len(tests),
        "test": len(tests),
        "test scenes": len({one.physical_scene for one in tests}),
        "test scenes also in training": len(leaking_scenes(splits)),
    }


@pytest.mark.parametrize("seed", range(4))
def test_by_scene_nothing_leaks_and_both_cameras_go_to_one_side(indexed, seed):
    report = indexed.run("split", by=SplitBy.SCENE, test_fraction=0.5, seed=seed)
    assert report.facts["test scenes also in training"] == 0
    assert len(set(read_split(indexed.folder("split")).values())) == 1  # there is one physical scene


@pytest.mark.parametrize("by", SplitBy)
def test_trajectories_of_equal_content_that_are_kept_go_to_one_side(make_pipeline, by):
    """By their own names the copies would part: at this seed the hashes of the two scenes and of two pairs differ."""
    drives = short(3, from_y_m=0.8)
    pipeline = make_pipeline({D435I: (drives, True), "box_d435i/hall (1)": (drives, True)})
    assert pipeline.run("index", same_content=SameContent.TOGETHER).refusals == {}
    pipeline.run("split", by=by, test_fraction=0.5, seed=1)
    splits = read_split(pipeline.folder("split"))
    assert len(splits) == 6
    own = own_sides(splits, by, 1)
    copies = {f"{D435I}/{number:06d}": f"{D435I} (1)/{number:06d}" for number in range(3)}
    assert {splits[name] == splits[copy] == own[name] for name, copy in copies.items()} == {True}
    assert any(own[copy] != own[name] for name, copy in copies.items())


def test_the_output_is_the_table_and_the_digest_its_bytes(indexed):
    indexed.run("split")
    outcome = indexed.outcomes("split")["split"]
    assert outcome.outputs == ("split.jsonl",)
    assert outcome.digest == sha256_file(indexed.folder("split") / "split.jsonl")


@pytest.mark.parametrize("fraction", [-0.1, 1.0, 1.5])
def test_a_fraction_that_leaves_nothing_to_train_on_is_refused(fraction):
    with pytest.raises(ConfigError, match=r"test_fraction must lie in \[0, 1\)"):
        build_config(SplitConfig, {"index": "i", "test_fraction": fraction})


def test_it_starts_from_a_finished_index(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)})
    with pytest.raises(ConfigError, match="run `wsm index` first"):
        pipeline.run("split")
