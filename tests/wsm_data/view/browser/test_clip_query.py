import pytest

from wsm_data.errors import ConfigError
from wsm_data.view.browser.clip_query import MAX_LIMIT, ClipQuery, parse_query, whole_number


def test_an_address_without_words_asks_for_the_first_page_of_all_clips():
    assert parse_query({}) == ClipQuery()


def test_words_of_an_address_become_limits_and_what_is_empty_or_of_the_page_is_left_out():
    words = {"text": "home", "is.split": "train", "is.group": "", "min.detour_ratio": "1.5", "max.detour_ratio": "2e0"}
    words |= {"sort": "detour_ratio", "descending": "1", "offset": "60", "limit": "30", "key": "a/b/c", "selection": ""}
    assert parse_query(words) == ClipQuery(
        text="home",
        words={"split": "train"},
        least={"detour_ratio": 1.5},
        most={"detour_ratio": 2.0},
        sort="detour_ratio",
        descending=True,
        offset=60,
        limit=30,
    )


def test_a_page_has_a_largest_size():
    assert parse_query({"limit": "999999"}).limit == MAX_LIMIT


@pytest.mark.parametrize("value", ["few", "nan", "1,5"])
def test_a_limit_that_is_no_number_is_refused(value):
    with pytest.raises(ConfigError, match=r"min\.detour_ratio must be a number, found"):
        parse_query({"min.detour_ratio": value})


@pytest.mark.parametrize("value", ["-1", "1.5", "x", "٣", "9" * 10])
def test_a_number_that_does_not_count_is_refused(value):
    with pytest.raises(ConfigError, match="offset must be a whole number of 0 or more"):
        whole_number({"offset": value}, "offset", 0)
