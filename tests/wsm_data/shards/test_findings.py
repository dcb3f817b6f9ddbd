from collections.abc import Callable

from wsm_data.shards.findings import FindingKind


def test_the_documentation_lists_every_kind_of_finding(words_of_table: Callable[[str], list[str]]) -> None:
    assert sorted(words_of_table("## What `wsm verify` checks")) == sorted(FindingKind)


def test_a_kind_is_text_for_reports() -> None:
    assert f"{FindingKind.CLIP_CUT}" == "clip.cut"
