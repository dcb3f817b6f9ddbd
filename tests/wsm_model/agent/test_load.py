from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_model.agent.config import AgentConfig
from wsm_model.agent.load import load_agent
from wsm_model.model_file import ModelCard, save_model


def save(folder, model, standard):
    save_model(folder, model, ModelCard(config=model.config, standard=standard, releases=("r",), steps=1))


def test_a_loaded_agent_answers_as_the_one_that_was_saved(tmp_path, model, standard, make_agent, camera, observe):
    save(tmp_path, model, standard)
    answers = []
    for agent in (make_agent(), load_agent(tmp_path, AgentConfig(), device="cpu")):
        agent.reset(camera, 1)
        answers.append(agent.plan({0: observe(0)})[0].path_m)
    assert np.array_equal(*answers)


def test_a_model_of_another_codec_is_refused(tmp_path, model, standard):
    save(tmp_path, model, replace(standard, codec_digest="another"))
    with pytest.raises(ConfigError, match="dct with digest another"):
        load_agent(tmp_path, AgentConfig())


def test_a_folder_without_a_model_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="there is no model"):
        load_agent(tmp_path, AgentConfig())
