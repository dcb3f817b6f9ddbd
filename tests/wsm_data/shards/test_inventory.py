from dataclasses import fields
from pathlib import Path

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.shards.inventory import (
    InventoryRow,
    UnitState,
    count_reasons,
    parse_inventory,
    parse_quarantine,
    write_inventory,
    write_quarantine,
)

ROWS = (
    InventoryRow(unit="a_zed/b/1", container="c", state=UnitState.CLIP, split="train", source_digest="d1"),
    InventoryRow(unit="a_zed/b/2", container="c", state=UnitState.REFUSED, reason="pose.jump", source_digest="d2"),
    InventoryRow(unit="a_zed/b/3", container="c", state=UnitState.PENDING, source_digest="d3"),
    InventoryRow(unit="z.tar.gz", container="z.tar.gz", state=UnitState.REFUSED, reason="archive.truncated"),
)


def test_an_inventory_comes_back_sorted_by_unit(tmp_path: Path) -> None:
    write_inventory(tmp_path / "a", reversed(ROWS))
    write_inventory(tmp_path / "b", ROWS)
    assert parse_inventory((tmp_path / "a").read_bytes(), "there") == ROWS
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_reasons_are_counted() -> None:
    assert count_reasons(ROWS) == {"archive.truncated": 1, "pose.jump": 1}


@pytest.mark.parametrize(
    "wrong",
    [
        {"state": UnitState.CLIP},
        {"state": UnitState.CLIP, "split": "train", "reason": "pose.jump"},
        {"state": UnitState.REFUSED},
        {"state": UnitState.REFUSED, "reason": "pose.jump", "split": "train"},
        {"state": UnitState.PENDING, "split": "train"},
    ],
)
def test_a_state_that_does_not_fit_its_split_and_reason_is_a_bug(wrong: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="a_zed/b/1: a "):
        InventoryRow(unit="a_zed/b/1", container="c", **wrong)


def test_a_clip_must_be_a_trajectory() -> None:
    with pytest.raises(ValueError, match="group/scene/episode"):
        InventoryRow(unit="z.tar.gz", container="c", state=UnitState.CLIP, split="train")


@pytest.mark.parametrize("data", [b"", b"nothing", b"PAR1" * 4])
def test_another_file_is_no_inventory(data: bytes) -> None:
    with pytest.raises(IntegrityError, match="there must be the inventory"):
        parse_inventory(data, "there")


REFUSALS = ({"unit": "b", "reason": "y", "time": 1.5, "seconds": 2}, {"unit": "a", "reason": "x", "details": {"n": 1}})


def test_refusals_are_sorted_and_lose_their_times(tmp_path: Path) -> None:
    write_quarantine(tmp_path / "q", REFUSALS)
    assert (tmp_path / "q").read_bytes() == (
        b'{"details":{"n":1},"reason":"x","unit":"a"}\n{"reason":"y","unit":"b"}\n'
    )


def test_refusals_of_another_time_and_order_give_equal_bytes(tmp_path: Path) -> None:
    write_quarantine(tmp_path / "q", REFUSALS)
    write_quarantine(tmp_path / "p", [REFUSALS[1], REFUSALS[0] | {"time": 99.0}])
    assert (tmp_path / "p").read_bytes() == (tmp_path / "q").read_bytes()


@pytest.mark.parametrize("wrong", [{"unit": "a"}, {"reason": "x"}, {"unit": "", "reason": "x"}])
def test_a_refusal_of_nothing_or_for_nothing_is_a_bug(wrong: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="must name its unit and reason"):
        write_quarantine(tmp_path / "q", [wrong])


@pytest.mark.parametrize("data", [b"{", b"[1]\n", b'{"unit":"a"}\n', b'{"unit":"a","reason":"x"}', b"\xff\n"])
def test_another_file_is_no_quarantine(data: bytes) -> None:
    with pytest.raises(IntegrityError, match="there must list the refusals"):
        parse_quarantine(data, "there")


def test_a_unit_whose_name_is_not_utf_8_is_spelled_alike_in_both_files(tmp_path: Path) -> None:
    name = b"home_\x80".decode(errors="surrogateescape")
    row = InventoryRow(unit=name, container=name, state=UnitState.REFUSED, reason="x")
    write_inventory(tmp_path / "i", [row])
    write_quarantine(tmp_path / "q", [{"unit": name, "reason": "x"}])
    [listed] = parse_inventory((tmp_path / "i").read_bytes(), "there")
    [written] = parse_quarantine((tmp_path / "q").read_bytes(), "there")
    assert listed.unit == listed.container == written["unit"] == "home_\\udc80"


def test_the_documentation_names_every_column(format_document: str) -> None:
    names = [f"`{item.name}`" for item in fields(InventoryRow)]
    assert f"columns {', '.join(names[:-1])} and {names[-1]}" in format_document
