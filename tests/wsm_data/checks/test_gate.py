import numpy as np
import pytest

from wsm_data.checks.gate import joined_verdict, require_kept
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


def test_several_reasons_become_one_error_that_tells_all_of_them():
    jump = Verdict(reason=Reason.POSE_JUMP, message="a jumps", measured={"frame": 3})
    mount = Verdict(reason=Reason.MOUNT_MISFIT, message="it leans", measured={"roll_deg": 8.0})
    with pytest.raises(DataError, match=r"a jumps; also mount.misfit: it leans") as caught:
        require_kept(Verdict(), jump, mount)
    assert caught.value.reason is Reason.POSE_JUMP
    assert caught.value.details["also"] == [{"reason": "mount.misfit", "measured": {"roll_deg": 8.0}}]


def test_nothing_refused_is_one_kept_verdict():
    assert joined_verdict([Verdict(), Verdict()]).keep
