import json

import pytest

from pipelines.artifacts.plan_file import PLAN_NAME, Estimate, Plan, read_plan, write_plan
from wsm_data.errors import IntegrityError

ONE = Estimate(value=2.0, low=1.5, high=4.0)
PLAN = Plan(
    recipe="interndata",
    source="here",
    workers=2,
    measured_workers=1,
    gpus=0,
    containers=10,
    sampled_containers=3,
    bytes_in=1000,
    sampled_bytes=300,
    bytes_out=ONE,
    peak_disk_bytes=ONE,
    hours=ONE,
    stage_hours={"index": ONE},
)


def test_a_plan_comes_back_as_it_was(tmp_path):
    assert read_plan(tmp_path) is None
    write_plan(tmp_path, PLAN)
    assert read_plan(tmp_path) == PLAN


def test_a_plan_that_was_changed_is_damage(tmp_path):
    write_plan(tmp_path, PLAN)
    record = json.loads((tmp_path / PLAN_NAME).read_text())
    (tmp_path / PLAN_NAME).write_text(json.dumps({**record, "workers": 3}))
    with pytest.raises(IntegrityError, match=r"plan\.json must hold a plan, but: it was changed .* `wsm plan` again"):
        read_plan(tmp_path)


def test_an_estimate_lies_within_its_bounds():
    with pytest.raises(ValueError, match="low <= value <= high"):
        Estimate(value=1.0, low=2.0, high=3.0)
