"""What was announced is known until it is read to its end, or so much was read since that nobody will read it."""

from hypothesis import given
from hypothesis import strategies as st

from wsm_data.access.announcements import Announcements
from wsm_data.access.shard_reader import Span


def announced(*spans):
    known = Announcements()
    for number, span in enumerate(spans):
        known.add(span, number)
    return known


A, B, C = Span("a.tar", 0, 10), Span("b.tar", 5, 10), Span("a.tar", 10, 10)


def test_shards_stand_in_the_order_in_which_they_are_needed():
    known = announced(B, A, C)
    assert known.shards() == ["b.tar", "a.tar"]
    known.remove(A)
    assert known.shards() == ["b.tar", "a.tar"]
    known.remove(C)
    known.add(A, 7)
    known.remove(B)
    known.add(B, 8)
    assert known.shards() == ["a.tar", "b.tar"]


def test_a_piece_belongs_to_the_stretch_that_holds_all_of_it():
    known = announced(A, B, C)
    assert known.find(Span("a.tar", 12, 8)) == (C, 2)
    assert known.find(Span("a.tar", 0, 0)) == (A, 0)
    assert known.find(Span("a.tar", 5, 10)) is None
    assert known.find(Span("b.tar", 4, 2)) is None
    assert known.find(Span("c.tar", 0, 1)) is None


def test_only_what_is_not_announced_is_unknown_and_each_once():
    assert announced(A).unknown([B, A, B, C]) == [B, C]


def test_striking_what_is_not_announced_changes_nothing():
    known = announced(A)
    known.remove(B)
    assert known.shards() == ["a.tar"]
    known.remove(A)
    known.remove(A)
    assert known.shards() == []


def test_what_was_left_behind_is_given_up(monkeypatch):
    monkeypatch.setattr("wsm_data.access.announcements._OUTDATED", 3)
    spans = [Span("a.tar", number, 1) for number in range(6)]
    known = announced(*spans)
    known.remove(spans[3])
    assert known.find(spans[0]) is not None
    known.remove(spans[5])
    assert [known.find(span) is not None for span in spans] == [False, False, True, False, True, False]


@given(st.lists(st.tuples(st.booleans(), st.sampled_from("ab"), st.integers(0, 4)), max_size=60))
def test_the_same_as_a_plain_list(steps):
    known, plain = Announcements(), []
    for is_new, shard, offset in steps:
        span = Span(f"{shard}.tar", offset * 10, 10)
        if is_new and known.unknown([span]):
            known.add(span, span)
            plain.append(span)
        elif not is_new:
            known.remove(span)
            plain = [other for other in plain if other != span]
        assert set(known.shards()) == {other.shard for other in plain}
        assert (known.find(span) is not None) == (span in plain)
