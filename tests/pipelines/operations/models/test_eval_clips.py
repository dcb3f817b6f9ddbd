"""wsm eval clips: the numbers of training, without training."""

import json
import shutil
from pathlib import Path

import pytest

from wsm_data.access.release import open_release


def measured_keys(wsm, trained, out, *words):
    code, text = wsm(
        "eval", "clips", trained.model, trained.release, "--out", out, *trained.likewise, "--quiet", *words
    )
    assert code == 0, text
    return [clip["key"] for clip in json.loads((out / "evaluation.json").read_text())["clips"]]


def test_the_numbers_are_those_that_training_wrote_to_the_byte(wsm, trained, tmp_path):
    measured_keys(wsm, trained, tmp_path, "--clips", "2")
    assert (tmp_path / "evaluation.json").read_bytes() == (trained.run / "evaluation.json").read_bytes()


def test_what_was_measured_is_named_beside_the_numbers(wsm, trained, tmp_path):
    measured_keys(wsm, trained, tmp_path, "--clips", "1")
    found = json.loads((tmp_path / "run.json").read_text())
    card = json.loads((trained.model / "model.json").read_text())
    assert found["model_sha256"] == card["weights_sha256"]
    assert found["release"] == open_release(trained.release).digest
    assert found["was_trained_on"] is True
    assert (found["held_out"]["split"], found["held_out"]["clips"]) == ("test", 1)
    assert found["held_out"]["session"]["chunk_size"] == 2


def test_a_release_that_the_card_does_not_name_was_not_trained_on(wsm, trained, tmp_path):
    folder = Path(shutil.copytree(trained.model, tmp_path / "model"))
    card = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps(card | {"releases": ["0" * 32]}))
    words = ("--out", tmp_path, *trained.likewise, "--clips", "1", "--quiet")
    code, text = wsm("eval", "clips", folder, trained.release, *words)
    assert code == 0, text
    assert json.loads((tmp_path / "run.json").read_text())["was_trained_on"] is False


def test_a_setting_says_how_many_clips_where_no_option_does(wsm, trained, tmp_path):
    assert len(measured_keys(wsm, trained, tmp_path, "--set", "clips=1")) == 1
    assert len(measured_keys(wsm, trained, tmp_path, "--set", "clips=1", "--clips", "2")) == 2


def test_the_seed_decides_which_clips_of_the_split_are_taken(wsm, trained, tmp_path):
    of_split = set(open_release(trained.release).keys(split="train"))
    taken = {
        seed: measured_keys(wsm, trained, tmp_path / seed, "--split", "train", "--clips", "1", "--seed", seed)[0]
        for seed in ("0", "1", "2")
    }
    assert set(taken.values()) <= of_split
    assert len(set(taken.values())) > 1
    again = measured_keys(wsm, trained, tmp_path / "again", "--split", "train", "--clips", "1", "--seed", "1")
    assert again == [taken["1"]]


def test_a_model_of_other_latents_is_refused_before_anything_is_written(wsm, trained, of_other_latents, tmp_path):
    code, text = wsm("eval", "clips", of_other_latents, trained.release, "--out", tmp_path / "out", "--quiet")
    assert code == 2
    assert "differ in codec_digest" in text
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--split", "none"], "must have clips of split 'none'"),
        (["--set", "flow_steps=0"], "flow_steps"),
        (["--set", "steps=1"], "steps"),
        (["--set", "clips=0"], "clips must be at least 1"),
        (["--set", "split=none"], "must have clips of split 'none'"),
    ],
)
def test_a_split_or_setting_that_is_not_there_is_refused(wsm, trained, tmp_path, words, said):
    code, text = wsm("eval", "clips", trained.model, trained.release, "--out", tmp_path / "out", "--quiet", *words)
    assert code == 2
    assert said in text
    assert not (tmp_path / "out").exists()
