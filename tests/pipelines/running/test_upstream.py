"""Stages that follow one another: what is handed on, and when a stage is told to run the one before it first."""

from dataclasses import replace

import pytest
from fake_runs import ANY
from fake_stages import COPY, JOIN, JoinConfig

from pipelines.running.folder import read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.runner import run_stage
from pipelines.running.stage import Finished
from pipelines.running.upstream import (
    DAMAGED_SUFFIX,
    done_outcomes,
    pending_units,
    quarantine_of,
    require_stage,
    upstream_records,
    vouched_by_ledger,
    vouched_by_record,
)
from wsm_data.errors import ConfigError, IntegrityError, Reason


@pytest.fixture
def joined(config, out):
    run_stage(COPY, config, out, ANY)
    run_stage(JOIN, JoinConfig(copy=out), out.with_name("join"), ANY)
    return out.with_name("join")


def test_work_that_follows_from_a_pending_unit_is_kept_and_is_no_result_until_that_unit_is_done(
    config, out, joined, calls
):
    (config.source / "a1.txt").write_text("other")
    (config.source / "b1.txt").write_text("other")
    run_stage(COPY, config, out, replace(ANY, limit=1))
    limited = run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    assert (limited.ran, limited.listed, limited.waits_for) == (("a1",), 2, ("copy",))
    assert list(done_outcomes(out)) == list(done_outcomes(joined)) == ["a1", "a2"]
    assert (joined / "b1").read_text() == "text of b1!"
    (config.source / "b1.txt").write_text("text of b1")
    calls()
    assert run_stage(COPY, config, out, ANY).ran == ()
    assert calls() == ["finish"]
    whole = run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    assert (whole.ran, whole.done, whole.waits_for) == ((), 3, ())
    assert list(done_outcomes(joined)) == ["a1", "a2", "b1"]


def test_work_whose_unit_comes_back_changed_is_done_again_and_replaces_what_was_kept(config, out, joined):
    (config.source / "b1.txt").write_text("other")
    run_stage(COPY, config, out, replace(ANY, only=("a*",)))
    run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    run_stage(COPY, config, out, ANY)
    assert run_stage(JOIN, JoinConfig(copy=out), joined, ANY).ran == ("b1",)
    assert (joined / "b1").read_text() == "other!"


def test_work_that_was_kept_goes_once_nothing_is_pending_and_its_unit_did_not_come_back(config, out, joined):
    (config.source / "b1.txt").write_text("other")
    run_stage(COPY, config, out, replace(ANY, only=("a*",)))
    run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    assert (joined / "b1").exists()
    (config.source / "b1.txt").unlink()
    run_stage(COPY, config, out, ANY)
    run_stage(JOIN, JoinConfig(copy=out), joined, ANY)
    assert not (joined / "b1").exists()
    assert set(read_ledger(joined, with_stale=True)) == {"a1", "a2"}


def test_a_dry_run_names_the_input_whose_pending_units_may_change_what_it_lists(config, out, joined):
    (config.source / "b1.txt").write_text("other")
    run_stage(COPY, config, out, replace(ANY, only=("a*",)))
    assert run_stage(JOIN, JoinConfig(copy=out), joined, replace(ANY, dry_run=True)).waits_for == ("copy",)


def test_a_change_goes_exactly_to_its_descendants(config, out, joined):
    (config.source / "a2.txt").write_text("other")
    run_stage(COPY, config, out, ANY)
    assert run_stage(JOIN, JoinConfig(copy=out), joined, ANY).ran == ("a2",)
    assert (joined / "a2").read_text() == "other!"


def test_a_stage_whose_input_has_moved_on_is_out_of_date_for_those_after_it(config, out, joined, tmp_path):
    again = replace(JOIN, name="again", list_units=lambda config: list_after_join(config))
    (config.source / "a2.txt").write_text("other")
    run_stage(COPY, config, out, ANY)
    with pytest.raises(ConfigError, match=r"join is older than its input .*copy; run `wsm join` again"):
        run_stage(again, JoinConfig(copy=joined), tmp_path / "again", ANY)


def list_after_join(config):
    require_stage(config.copy, "join")
    return []


def test_a_stage_is_finished_again_when_its_input_moved_on_though_no_unit_changed(config, out, joined):
    finished = []
    counting = replace(JOIN, finish=lambda *_: finished.append(1) or Finished())
    run_stage(counting, JoinConfig(copy=out), joined, ANY)
    (config.source / "c1.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    assert finished == []
    assert run_stage(counting, JoinConfig(copy=out), joined, ANY).ran == ()
    assert finished == [1]
    assert read_stage_record(joined).seen == {"copy": read_stage_record(out).finished}


def test_an_upstream_stage_that_was_cut_short_is_refused(config, out):
    (config.source / "a2.txt").write_text("bug")
    with pytest.raises(ValueError, match="a bug in a2"):
        run_stage(COPY, config, out, ANY)
    with pytest.raises(ConfigError, match="`wsm copy` has not come to its end"):
        run_stage(JOIN, JoinConfig(copy=out), out.with_name("join"), ANY)


def test_an_upstream_stage_is_unfinished_as_soon_as_a_new_run_of_it_begins(config, out, joined):
    (config.source / "a2.txt").write_text("bug")
    with pytest.raises(ValueError, match="a bug in a2"):
        run_stage(COPY, config, out, ANY)
    with pytest.raises(ConfigError, match="`wsm copy` has not come to its end"):
        run_stage(JOIN, JoinConfig(copy=out), joined, ANY)


@pytest.mark.parametrize("made", ["nothing", "another stage"])
def test_a_folder_that_is_not_the_upstream_stage_is_refused(out, joined, made):
    folder = joined if made == "another stage" else out.with_name("empty")
    with pytest.raises(
        ConfigError, match=r"must hold the output of `wsm copy`, found (nothing|the output of `wsm join`)"
    ):
        run_stage(JOIN, JoinConfig(copy=folder), out.with_name("join2"), ANY)


def test_what_a_stage_did_is_read_from_its_folder(config, out):
    (config.source / "a2.txt").write_text("bad")
    run_stage(COPY, config, out, replace(ANY, limit=2))
    assert list(done_outcomes(out)) == ["a1"]
    assert [(one.unit, one.reason) for one in quarantine_of(out)] == [("a2", Reason.FRAME_EMPTY)]
    assert pending_units(out) == ("b1",)


def test_done_units_are_sorted_whatever_the_order_in_which_they_were_done(config, out):
    run_stage(COPY, config, out, replace(ANY, only=("b*",)))
    run_stage(COPY, config, out, ANY)
    assert list(done_outcomes(out)) == ["a1", "a2", "b1"]


def test_only_inputs_that_a_stage_has_written_have_a_record(config, out):
    run_stage(COPY, config, out, ANY)
    assert upstream_records(config) == {}
    assert upstream_records(JoinConfig(copy=out)) == {"copy": read_stage_record(out)}


def damage(path):
    path.write_bytes(path.read_bytes()[::-1])


def test_what_a_unit_wrote_is_vouched_for_by_its_ledger_and_made_again_where_it_is_not(config, out):
    run_stage(COPY, config, out, ANY)
    outcome = done_outcomes(out)["a1"]
    path = out / outcome.outputs[0]
    before = path.read_bytes()
    assert vouched_by_ledger(out, outcome, path) == path
    damage(path)
    with pytest.raises(IntegrityError, match=r"must hold what `wsm copy` wrote, found other bytes, which are kept as"):
        vouched_by_ledger(out, outcome, path)
    assert path.with_name(path.name + DAMAGED_SUFFIX).read_bytes() == before[::-1]
    assert run_stage(COPY, config, out, ANY).ran == ("a1",)
    assert path.read_bytes() == before


def test_a_file_of_the_same_size_that_was_touched_and_changed_is_made_again_by_the_same_command(config, out):
    run_stage(COPY, config, out, ANY)
    path = out / done_outcomes(out)["a1"].outputs[0]
    before = path.read_bytes()
    path.touch()
    assert run_stage(COPY, config, out, ANY).ran == ()
    damage(path)
    assert run_stage(COPY, config, out, ANY).ran == ("a1",)
    assert path.read_bytes() == before


def test_what_a_stage_wrote_at_its_end_is_vouched_for_by_its_record(config, out):
    run_stage(COPY, config, out, ANY)
    assert vouched_by_record(out, "words.json") == out / "words.json"
    damage(out / "words.json")
    with pytest.raises(IntegrityError, match=r"words\.json must hold what `wsm copy` wrote, found other bytes"):
        vouched_by_record(out, "words.json")
    with pytest.raises(IntegrityError, match="found nothing"):
        vouched_by_record(out, "words.json")
    run_stage(COPY, config, out, ANY)
    assert vouched_by_record(out, "words.json").is_file()


def test_a_record_that_was_changed_is_refused(config, out):
    run_stage(COPY, config, out, ANY)
    record = out / "stage.json"
    record.write_text(record.read_text().replace('"workers": 1', '"workers": 2'))
    with pytest.raises(IntegrityError, match="it was changed since it was written"):
        read_stage_record(out)
