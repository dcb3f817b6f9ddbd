import pytest

from wsm_model.agent.config import AgentConfig
from wsm_model.inference.session import SessionConfig


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flow_steps": 0}, "flow_steps"),
        ({"steps_per_frame": 0}, "steps_per_frame"),
        ({"executed_poses": 9, "session": SessionConfig(chunk_size=2)}, "1 to 8"),
    ],
)
def test_settings_that_no_agent_can_have_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        AgentConfig(**changes)
