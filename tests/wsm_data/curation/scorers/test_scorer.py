import math

import pytest

from wsm_data.curation.scorers.scorer import require_score
from wsm_data.curation.scores_table import Direction, ScorerInfo

ALWAYS = ScorerInfo(name="width_m", unit="m", direction=Direction.LOWER, summary="how wide")
SOMETIMES = ScorerInfo(name="cost", unit="m", direction=Direction.HIGHER, summary="what it costs", absent="unpaid")


def test_an_absent_score_is_stored_as_nan_where_that_may_be():
    assert math.isnan(require_score(SOMETIMES, None, "k"))
    assert require_score(ALWAYS, 1, "k") == 1.0


@pytest.mark.parametrize(
    ("info", "value"), [(ALWAYS, None), (ALWAYS, math.nan), (SOMETIMES, math.nan), (SOMETIMES, math.inf)]
)
def test_what_is_no_number_is_the_bug_of_the_scorer_and_names_clip_and_score(info, value):
    with pytest.raises(ValueError, match=f"{info.name} of clip g/s/7"):
        require_score(info, value, "g/s/7")
