import numpy as np
import pytest

from wsm_data.checks.gate import require_kept
from wsm_data.errors import DataError, Reason
from wsm_data.schema.verdict import Verdict


def test_what_a_check_keeps_goes_on():
    require_kept(Verdict(measured={"clearance_m": 0.3}))


def test_what_a_check_refuses_becomes_an_error_with_its_reason_words_and_numbers():
    verdict = Verdict(reason=Reason.POSE_JUMP, message="a jumps", measured={"step_m": np.float32(0.5), "frame": 3})
    with pytest.raises(DataError, match="a jumps") as caught:
        require_kept(verdict)
    assert caught.value.reason is Reason.POSE_JUMP
    assert caught.value.details == {"step_m": 0.5, "frame": 3}
