"""What a trace holds."""

import json

import torch

from wsm_model.training.profile import TABLE, TRACE, WARM_UP_STEPS, profiled


def test_it_records_so_many_steps_after_those_of_the_warm_up(tmp_path):
    """Step n multiplies n times: steps 4 and 5 are recorded, with 9 products."""
    with profiled(tmp_path, 2) as tick:
        for number in range(1, WARM_UP_STEPS + 6):
            for _ in range(number):
                torch.ones(3, 3) @ torch.ones(3, 3)
            tick()
    events = json.loads((tmp_path / TRACE).read_text())["traceEvents"]
    assert sum(event.get("name") == "aten::mm" for event in events) == 4 + 5
    assert "aten::mm" in (tmp_path / TABLE).read_text()


def test_none_are_recorded_unless_they_are_asked_for(tmp_path):
    with profiled(tmp_path / "profile", 0) as tick:
        tick()
    assert not (tmp_path / "profile").exists()
