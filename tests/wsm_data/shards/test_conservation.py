from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace

import pytest

from wsm_data.access.release import open_release
from wsm_data.shards.conservation import check_conservation, check_counts
from wsm_data.shards.index.table import IndexTable, index_table
from wsm_data.shards.inventory import InventoryRow, UnitState

FIRST = "synth_d435i/home_0001/000000"
REFUSED = "synth_d435i/home_0002/000009"


@pytest.fixture
def books(tiny: SimpleNamespace) -> SimpleNamespace:
    release = open_release(tiny.folder)
    return SimpleNamespace(
        manifest=release.manifest, index=release.index, inventory=release.inventory, quarantine=release.quarantine
    )


def _check(books: SimpleNamespace, **changes: object) -> list[tuple[str, str | None]]:
    findings = check_conservation(**{**vars(books), **changes})
    return [(str(finding.kind), finding.clip) for finding in findings]


def _without(rows: Sequence[InventoryRow], unit: str) -> list[InventoryRow]:
    return [row for row in rows if row.unit != unit]


def _index(books: SimpleNamespace, change: Callable[[list], list]) -> IndexTable:
    return IndexTable(index_table(change([books.index.row_at(number) for number in range(len(books.index))])))


def test_books_that_agree_have_no_findings(books: SimpleNamespace) -> None:
    assert _check(books) == []
    assert list(check_counts(books.manifest, books.index, books.inventory)) == []


def test_a_clip_in_no_place_is_found(books: SimpleNamespace) -> None:
    index = _index(books, lambda rows: [row for row in rows if row.key != FIRST])
    assert _check(books, index=index) == [("unit.lost", FIRST)]


def test_a_clip_that_never_went_in_is_found(books: SimpleNamespace) -> None:
    assert _check(books, inventory=_without(books.inventory, FIRST)) == [("unit.unknown", FIRST)]


def test_a_clip_in_two_places_is_found(books: SimpleNamespace) -> None:
    index = _index(books, lambda rows: [*rows, rows[0]])
    assert _check(books, index=index) == [("unit.twice", books.index.row_at(0).key)]


def test_a_trajectory_that_went_in_twice_is_found(books: SimpleNamespace) -> None:
    assert _check(books, inventory=[*books.inventory, books.inventory[0]])[0] == ("unit.twice", books.inventory[0].unit)


def test_a_refusal_that_is_nowhere_written_down_is_found(books: SimpleNamespace) -> None:
    quarantine = [line for line in books.quarantine if line["unit"] != REFUSED]
    assert _check(books, quarantine=quarantine) == [("unit.lost", REFUSED)]


def test_a_refusal_for_another_reason_is_found_on_both_sides(books: SimpleNamespace) -> None:
    quarantine = [{**line, "reason": "pose.jump"} for line in books.quarantine if line["unit"] == REFUSED]
    quarantine += [line for line in books.quarantine if line["unit"] != REFUSED]
    assert _check(books, quarantine=quarantine) == [("unit.lost", REFUSED), ("unit.unknown", REFUSED)]


def test_a_trajectory_that_is_both_clip_and_refused_is_found(books: SimpleNamespace) -> None:
    line = {"unit": FIRST, "reason": "pose.jump"}
    assert _check(books, quarantine=[*books.quarantine, line]) == [("unit.twice", FIRST)]
    row = InventoryRow(unit=FIRST, container="c", state=UnitState.REFUSED, reason="pose.jump")
    both = _check(books, quarantine=[*books.quarantine, line], inventory=[*books.inventory, row])
    assert both == [("unit.twice", FIRST)]


def test_a_refusal_of_something_that_never_went_in_is_found(books: SimpleNamespace) -> None:
    line = {"unit": "synth_zed/x/1", "reason": "pose.jump"}
    assert _check(books, quarantine=[*books.quarantine, line]) == [("unit.unknown", "synth_zed/x/1")]


def test_a_trajectory_that_is_neither_clip_nor_refused_is_found_unless_the_release_is_partial(
    books: SimpleNamespace,
) -> None:
    row = InventoryRow(unit="synth_zed/x/1", container="c", state=UnitState.PENDING)
    inventory = [*books.inventory, row]
    assert _check(books, inventory=inventory) == [("unit.lost", "synth_zed/x/1")]
    assert _check(books, inventory=inventory, manifest=replace(books.manifest, partial=True)) == []


def test_a_duplicate_is_one_more_refusal_of_an_id_that_stands_for_itself(books: SimpleNamespace) -> None:
    duplicate = InventoryRow(unit=FIRST, container="d", state=UnitState.REFUSED, reason="episode.duplicate")
    line = {"unit": FIRST, "reason": "episode.duplicate"}
    changes = {"inventory": [*books.inventory, duplicate], "quarantine": [*books.quarantine, line]}
    assert _check(books, **changes) == []
    assert _check(books, inventory=changes["inventory"]) == [("unit.lost", FIRST)]
    assert _check(books, quarantine=changes["quarantine"]) == [("unit.twice", FIRST)]


def test_of_two_trajectories_of_one_id_in_one_container_neither_is_kept_and_nothing_is_lost(
    books: SimpleNamespace,
) -> None:
    duplicate = InventoryRow(unit="synth_zed/x/1", container="d", state=UnitState.REFUSED, reason="episode.duplicate")
    line = {"unit": "synth_zed/x/1", "reason": "episode.duplicate"}
    assert _check(books, inventory=[*books.inventory, duplicate], quarantine=[*books.quarantine, line]) == []
    assert _check(books, inventory=[*books.inventory, duplicate]) == [("unit.lost", "synth_zed/x/1")]


@pytest.mark.parametrize("change", [{"split": "test"}, {"source_digest": "other"}])
def test_a_clip_that_came_out_otherwise_than_it_went_in_is_found(
    books: SimpleNamespace, change: dict[str, str]
) -> None:
    changed = [replace(row, **change) if row.unit == FIRST else row for row in books.inventory]
    assert _check(books, inventory=changed) == [("clip.mismatch", FIRST)]


@pytest.mark.parametrize(
    "change",
    [
        *({"clips": 8}, {"frames": 1}, {"latents": 1}, {"clips_by_split": {"train": 7}}, {"clips_by_group": {}}),
        *({"shards": ()}, {"drops": {}}, {"pending": 1}),
    ],
)
def test_a_number_that_is_not_what_the_files_hold_is_found(books: SimpleNamespace, change: dict[str, object]) -> None:
    [finding] = check_counts(replace(books.manifest, **change), books.index, books.inventory)
    assert finding.kind == "release.count"


@pytest.mark.parametrize("which", ["rgb_statistics", "depth_statistics"])
@pytest.mark.parametrize(
    "change",
    [
        lambda one: replace(one, std=(0.0, *one.std[1:])),
        lambda one: replace(one, mean=(float("nan"), *one.mean[1:])),
        lambda one: replace(one, mean=one.mean[:-1]),
        lambda one: replace(one, std=one.std[:-1]),
        lambda one: replace(one, count=one.count - 1),
        lambda one: replace(one, count=0, mean=(), std=()),
    ],
)
def test_statistics_that_latents_cannot_be_divided_by_are_found(books: SimpleNamespace, which: str, change) -> None:
    manifest = replace(books.manifest, **{which: change(getattr(books.manifest, which))})
    [finding] = check_counts(manifest, books.index, books.inventory)
    assert str(finding.kind) == "release.count"
    assert finding.message.startswith(f"{which} must be finite, of ")
