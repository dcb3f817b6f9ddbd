from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from pipelines.operations.planning.sample import LEAST_CONTAINERS, SourceSizes, draw
from pipelines.running.stage import Unit


def source_of(sizes):
    units = tuple(Unit(id=name, inputs={}) for name in sizes)
    return SourceSizes(root=Path(), size_bytes=0, units=units, sizes=sizes)


@given(st.lists(st.integers(1, 1000), min_size=1, max_size=40), st.floats(0.01, 1.0))
def test_a_sample_is_of_the_share_that_is_asked_for_and_never_of_fewer_than_three(sizes, share):
    source = source_of({f"c{number}": size for number, size in enumerate(sizes)})
    chosen = draw(source, share)
    taken = [source.size(unit.id) for unit in chosen]
    assert len({unit.id for unit in chosen}) == len(chosen) >= min(LEAST_CONTAINERS, len(sizes))
    assert sum(taken) >= share * sum(sizes) * (1 - 1e-9)
    assert len(chosen) == min(LEAST_CONTAINERS, len(sizes)) or sum(taken[:-1]) < share * sum(sizes)


def test_a_larger_sample_holds_the_smaller_one_and_none_depends_on_the_order_of_the_listing():
    sizes = {f"c{number}": 1 + number for number in range(30)}
    small, large = (draw(source_of(sizes), share) for share in (0.1, 0.5))
    assert small == large[: len(small)]
    assert draw(source_of(dict(reversed(sizes.items()))), 0.5) == large


def test_containers_without_files_of_their_own_count_one_each():
    source = SourceSizes(root=Path(), size_bytes=9, units=source_of({"a": 1, "b": 1}).units, sizes={})
    assert source.size("a") == 1.0
