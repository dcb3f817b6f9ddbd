import shlex

import pytest

from pipelines.running.command_text import command_text
from pipelines.running.settings import parse_assignments
from pipelines.stages.select import SelectConfig
from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.exclusion import ExclusionConfig
from wsm_data.curation.quotas import Limits, Quota, QuotaConfig
from wsm_data.curation.rule import RuleConfig, RuleKind
from wsm_data.files.typed_toml import build_config

DEFAULT = SelectConfig(release="R")


def text(**changes):
    return command_text("wsm select R", SelectConfig(release="R", **changes), DEFAULT)


def test_defaults_and_inputs_are_not_named():
    assert text(scores="elsewhere.parquet") == "wsm select R"


def test_single_settings_are_named_by_their_section():
    assert text(fraction=0.2, diversity=DiversityConfig(within_m=0.0)) == (
        "wsm select R --set fraction=0.2 --set diversity.within_m=0.0"
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"rule": RuleConfig(weights={"detour_ratio": 1.5, "texture_ratio": 1e-7})},
        {"rule": RuleConfig(kind=RuleKind.LEXICOGRAPHIC, order=("a", "b c"))},
        {"quotas": QuotaConfig(scene=Quota(at_most=0.2, named={"g/a.b 'x\" ü": Limits(at_least=1, at_most=3)}))},
        {"quotas": QuotaConfig(camera=Quota(at_least=2.0, at_most=0.0))},
        {"exclude": ExclusionConfig(hopeless=False, at_least={"cost": -1.0}), "name": "very-hard.2", "split": "test"},
    ],
)
def test_the_command_builds_the_same_settings(changes):
    words = shlex.split(text(**changes))[3:]
    assert words[::2] == ["--set"] * (len(words) // 2)
    built = build_config(SelectConfig, {"release": "R", **parse_assignments(words[1::2])})
    assert built == SelectConfig(release="R", **changes)


def test_the_order_in_which_settings_were_given_does_not_show():
    one, other = ({"detour_ratio": 1.0, "texture_ratio": 2.0}, {"texture_ratio": 2.0, "detour_ratio": 1.0})
    assert text(rule=RuleConfig(weights=one)) == text(rule=RuleConfig(weights=other))
