"""The stages of the project."""

import pickle

import pytest

from pipelines.registry import STAGES, load_stage
from wsm_data.errors import ConfigError


@pytest.mark.parametrize("name", [entry.name for entry in STAGES])
def test_a_stage_is_found_under_its_name(name):
    assert load_stage(name).name == name


@pytest.mark.parametrize("name", [entry.name for entry in STAGES])
def test_a_stage_travels_to_worker_processes(name):
    stage = load_stage(name)
    assert pickle.loads(pickle.dumps(stage)) == stage  # noqa: S301 - our own bytes, as a worker gets them


def test_an_unknown_stage_is_refused_with_the_nearest():
    with pytest.raises(ConfigError, match="there is no stage 'encod'; did you mean encode"):
        load_stage("encod")
