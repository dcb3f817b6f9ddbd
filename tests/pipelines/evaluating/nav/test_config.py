import pytest

from pipelines.evaluating.nav.config import NavConfig, fixed_settings
from wsm_data.errors import ConfigError
from wsm_data.sim.config import SimConfig


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"planner": "orakel"}, "must be one of oracle, .*agent or a URL, found 'orakel'"),
        ({"planner": "agent"}, "--model belongs to --planner agent"),
        ({"planner": "oracle", "model": "x"}, "--model belongs to --planner agent"),
        ({"planner": "reactive", "sim": SimConfig(estimated_controller_pose=True)}, "says where it believes to be"),
    ],
)
def test_what_does_not_go_together_is_refused_before_any_work(settings, message):
    with pytest.raises(ConfigError, match=message):
        NavConfig(**settings)


def test_a_model_counts_by_its_content_and_must_be_there(tmp_path):
    config = NavConfig(planner="agent", model=tmp_path)
    with pytest.raises(ConfigError, match=r"model\.json"):
        fixed_settings(config)
    digests = set()
    for text in ("{}", "{ }"):
        (tmp_path / "model.json").write_text(text)
        digests.add(fixed_settings(config)["model"])
    assert len(digests) == 2
