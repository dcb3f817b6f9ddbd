"""Outputs that are given up: the work stays done, the bytes go, and come back when somebody needs them."""

import pytest
from fake_runs import ANY, copies
from fake_stages import COPY, JOIN, JoinConfig

from pipelines.running.given_up import OutputsNeeded, giving_up, present_bytes, require_given_back
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.errors import ConfigError

RECLAIM = RunOptions(quiet=True, reclaim=True)
ALL = {name: (f"copies/{name}.txt",) for name in ("a1", "a2", "b1")}


@pytest.fixture
def joined(config, out, calls):
    """`copy` and `join`, both finished; the folder of `join`."""
    folder = out.parent / "join"
    run_stage(COPY, config, out, ANY)
    run_stage(JOIN, JoinConfig(copy=out), folder, ANY)
    calls()
    return folder


def give_up(out, outputs=ALL):
    with giving_up(out) as give:
        return give(outputs)


def test_what_is_given_up_is_deleted_and_counted_and_its_units_are_still_done(joined, config, out, calls):
    assert present_bytes(out, ALL) == 3 * len("text of a1")
    assert give_up(out) == 3 * len("text of a1")
    assert copies(out) == {}
    report = run_stage(COPY, config, out, ANY)
    assert (report.ran, report.done) == ((), 3)
    assert run_stage(JOIN, JoinConfig(copy=out), joined, ANY).ran == ()
    assert calls() == []


def test_a_file_that_a_killed_clean_left_is_deleted_by_the_next(joined, out):
    give_up(out)
    (out / "copies" / "a1.txt").write_text("text of a1")
    assert give_up(out) == len("text of a1")


def test_what_is_needed_again_is_made_again_and_nothing_else(joined, config, out, calls):
    give_up(out)
    (joined / "a2").unlink()
    with pytest.raises(OutputsNeeded, match=r"1 units of .* such as a2; run `wsm copy` again"):
        run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    assert run_stage(COPY, config, out, ANY).ran == ("a2",)
    assert run_stage(JOIN, JoinConfig(copy=out), joined, ANY).ran == ("a2",)
    assert (joined / "a2").read_text() == "text of a2!"
    assert copies(out) == {"a2": "text of a2"}


def test_what_was_given_up_and_is_still_there_is_taken_as_it_is(joined, config, out):
    data = (out / "copies" / "a1.txt").read_bytes()
    give_up(out, {"a1": ALL["a1"]})
    (out / "copies" / "a1.txt").write_bytes(data)
    require_given_back({out: {"a1": ALL["a1"]}})
    assert read_ledger(out)["a1"].given_up == ()
    assert run_stage(COPY, config, out, ANY).ran == ()


def test_a_stage_that_reclaims_gives_up_what_each_unit_has_read(config, out):
    run_stage(COPY, config, out, ANY)
    folder = out.parent / "join"
    report = run_stage(JOIN, JoinConfig(copy=out), folder, RECLAIM)
    assert report.done == 3
    assert copies(out) == {}
    assert {one.given_up for one in read_ledger(out).values()} == set(ALL.values())


def test_a_finished_stage_reclaims_what_it_has_read_before(joined, out):
    run_stage(JOIN, JoinConfig(copy=out), joined, RECLAIM)
    assert copies(out) == {}


def test_nothing_is_reclaimed_while_more_is_to_come(config, out):
    run_stage(COPY, config, out, RunOptions(quiet=True, limit=2))
    with pytest.raises(ConfigError, match="pending units in copy"):
        run_stage(JOIN, JoinConfig(copy=out), out.parent / "join", RECLAIM)
    assert set(copies(out)) == {"a1", "a2"}


def test_the_folder_that_is_given_up_from_is_held_against_other_writers(joined, out):
    with giving_up(out), pytest.raises(ConfigError, match="being written by another wsm process"):
        give_up(out)
