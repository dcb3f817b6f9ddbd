import re

import numpy as np
import pytest

from wsm_data.curation.explain import (
    ExplainedScore,
    deciding_scores,
    explain_clips,
    leading_scores,
    score_label,
    value_text,
)
from wsm_data.curation.scores_table import Direction, ScorerInfo


def score(name, values, percentiles, *, unit="ratio", direction=Direction.HIGHER, weight=1.0, emphasis=1):
    return ExplainedScore(
        info=ScorerInfo(name=name, unit=unit, direction=direction, summary="", absent="x"),
        weight=weight,
        emphasis=emphasis,
        values=np.array(values, float),
        percentiles=np.array(percentiles, np.float32),
    )


def test_the_scores_that_weigh_most_are_named_first_and_easy_ones_not_at_all():
    scores = [
        score("detour_ratio", [2.8], [0.99]),
        score("turning_total_rad", [9.42], [0.9], unit="rad", weight=2.0),
        score("texture_ratio", [1.0], [0.2]),
    ]
    assert explain_clips(scores).to_pylist() == [
        "turning total 9.42 rad (90th percentile); detour 2.8 (99th percentile)"
    ]


def test_of_a_score_whose_low_end_is_hard_the_percentile_is_low():
    scores = [score("clearance_least_m", [0.123], [0.976], unit="m", direction=Direction.LOWER)]
    assert explain_clips(scores).to_pylist() == ["clearance least 0.123 m (2nd percentile)"]


def test_a_clip_that_is_hard_by_nothing_is_explained_by_its_hardest_score():
    scores = [score("a", [1.0], [0.3]), score("b", [5.0], [0.4])]
    assert explain_clips(scores).to_pylist() == ["b 5 (40th percentile)"]


def test_a_lexicographic_rule_is_explained_in_its_order_whatever_the_percentiles():
    scores = [score("unsafe_share", [0.25], [0.3], unit="share"), score("cost", [7.0], [0.9])]
    assert explain_clips(scores, in_order=True).to_pylist() == [
        "unsafe 25 % (30th percentile); cost 7 (90th percentile)"
    ]


def test_at_most_three_scores_are_named_and_absent_ones_are_not():
    scores = [score(name, [1.0, np.nan], [0.9, np.nan]) for name in "abcd"]
    scores.append(score("e", [1.0, 2.0], [0.6, 0.6]))
    first, second = explain_clips(scores).to_pylist()
    assert first == "a 1 (90th percentile); b 1 (90th percentile); c 1 (90th percentile)"
    assert second == "e 2 (60th percentile)"


def test_every_clip_gets_the_text_of_its_own_value():
    rng = np.random.default_rng(0)
    values = rng.normal(0, 10.0 ** rng.integers(-4, 5, 500))
    values[7] = 0.0
    percentiles = rng.uniform(0, 1, 500)
    found = explain_clips([score("x_m", values, percentiles, unit="m")]).to_pylist()
    for text, value, percentile in zip(found, values, percentiles.astype(np.float32), strict=True):
        number, share = re.fullmatch(r"x (\S+) m \((\d+)(?:st|nd|rd|th) percentile\)", text).groups()
        assert float(number.replace(",", "")) == pytest.approx(value, rel=5.1e-3)  # three digits
        assert int(share) == pytest.approx(np.clip(100 * percentile - 0.5, 1, 99), abs=0.501)


@pytest.mark.parametrize(
    ("percentile", "text"), [(0.015, "1st"), (0.02, "2nd"), (0.03, "3rd"), (0.12, "12th"), (1, "99th")]
)
def test_ordinals_are_those_of_english_and_stay_from_1_to_99(percentile, text):
    assert f"({text} percentile)" in explain_clips([score("a", [1.0], [percentile + 1e-3])])[0].as_py()


def test_the_leading_score_is_that_of_the_largest_weighted_percentile():
    scores = [score("a", [1, 1, 1], [0.9, 0.4, np.nan]), score("b", [1, 1, 1], [0.5, 0.5, 0.1], weight=1.5)]
    assert leading_scores(scores).tolist() == [0, 1, 1]


def test_values_carry_their_unit_and_names_do_not():
    assert (value_text(0.5, "share"), value_text(2.0, "ratio"), value_text(1234.5, "m")) == ("50 %", "2", "1,234 m")
    names = [("dead_end_share", "share"), ("view_change_rad_per_frame", "rad per frame"), ("path_length_m", "m")]
    labels = [
        score_label(ScorerInfo(name=name, unit=unit, direction=Direction.HIGHER, summary="")) for name, unit in names
    ]
    assert labels == ["dead end", "view change", "path length"]


def test_with_emphasis_an_extreme_score_weighs_more_than_a_heavy_one():
    heavy, extreme = {"values": [1.0], "percentiles": [0.6], "weight": 2.0}, {"values": [9.0], "percentiles": [1.0]}
    for emphasis, leading in ((1, 0), (2, 1)):
        scores = [score("heavy", emphasis=emphasis, **heavy), score("extreme", emphasis=emphasis, **extreme)]
        assert leading_scores(scores).tolist() == [leading]


def test_a_lexicographic_rule_is_led_by_the_score_that_tells_a_clip_from_the_first_left_out():
    percentiles = [0.5] * 5
    scores = [
        score("unsafe", [1.0, 0.5, 0.5, np.nan, 0.5], percentiles),
        score("cost", [2.0, 9.0, 3.0, 4.0, 3.0], percentiles),
    ]
    assert deciding_scores(scores, 4).tolist() == [0, 1, 0, 1, 0]  # the third is equal in both: its first score
    assert deciding_scores(scores, None).tolist() == [0, 0, 0, 1, 0]


def test_a_score_that_only_the_clip_left_out_lacks_decides():
    scores = [score("unsafe", [0.0, np.nan], [0.5, np.nan]), score("cost", [1.0, 1.0], [0.5, 0.5])]
    assert deciding_scores(scores, 1).tolist() == [0, 1]


def test_texts_hold_the_digits_of_the_value_over_all_powers_of_ten():
    values = [1.5e-296, 9.996e-4, 0.9999, 1.0, 999.4, 999.6, 1e15, 1.7e308, -0.125, 1e-310]
    found = explain_clips([score("x_m", values, [0.9] * len(values), unit="m")]).to_pylist()
    shown = [float(text.split()[1].replace(",", "")) for text in found]
    assert shown[:-1] == [float(f"{value:.2e}") for value in values[:-1]]
    assert shown[-1] == 0.0
