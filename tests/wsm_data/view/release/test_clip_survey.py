import dataclasses

import pytest

from wsm_data.errors import ConfigError
from wsm_data.view.release.clip_survey import SurveyConfig, ranked_keys, survey_clips


class OtherCodec:
    """The same codec under another digest."""

    def __init__(self, codec):
        self._codec = codec

    def __getattr__(self, name):
        return getattr(self._codec, name)

    def describe(self):
        return dataclasses.replace(self._codec.describe(), digest="another")


def test_every_clip_of_a_small_release_is_read(release, made):
    survey = survey_clips(release, made.codec)
    assert survey.clips_in_release == 6
    assert [facts.key for facts in survey.facts] == sorted(release.index.texts("key"))
    assert sorted(scene.scene for scene in survey.scenes) == [
        f"synth/{made.hostile_scene}",
        "synth/home_0001",
        "synth/home_0002",
        "synth/home_0003",
    ]
    assert sum(len(scene.paths) for scene in survey.scenes) == 6


def test_a_sample_is_the_head_of_a_fixed_ranking(release, made):
    keys = release.index.texts("key")
    survey = survey_clips(release, made.codec, SurveyConfig(max_clips=3))
    assert [facts.key for facts in survey.facts] == sorted(ranked_keys(keys)[:3])
    assert survey.clips_in_release == 6


def test_the_ranking_depends_on_nothing_but_the_keys():
    keys = [f"group/scene/{number:06d}" for number in range(50)]
    assert ranked_keys(keys) == ranked_keys(reversed(keys))
    assert ranked_keys(keys) != keys
    assert [key for key in ranked_keys(keys) if key in keys[:9]] == ranked_keys(keys[:9])


def test_thumbnails_show_different_scenes_before_a_scene_comes_twice(release, made):
    survey = survey_clips(release, made.codec, SurveyConfig(thumbnails=4, pictures=2))
    assert len({shown.clip.meta.id.physical_scene for shown in survey.thumbnails}) == 4
    assert {shown.pictures.frames for shown in survey.thumbnails} == {(0, 8)}
    splits = {unit.replace(made.hostile_scene, "x"): split for unit, split in made.units.items()}
    for shown in survey.thumbnails:
        assert shown.split == splits[shown.clip.meta.id.text.replace(made.hostile_scene, "x")]


def test_scenes_and_their_paths_are_limited(release, made):
    survey = survey_clips(release, made.codec, SurveyConfig(scenes=2, paths=1))
    assert [len(scene.paths) for scene in survey.scenes] == [1, 1]


def test_nothing_is_decoded_with_another_codec(release, made):
    with pytest.raises(ConfigError, match="another"):
        survey_clips(release, OtherCodec(made.codec))
