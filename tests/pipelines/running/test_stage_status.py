"""Where a stage stands while it is written, when it was cut short, and afterwards."""

import os
from dataclasses import replace

import pytest
from fake_runs import ANY
from fake_stages import COPY

from pipelines.running.folder import read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.lock_holder import held_locks
from pipelines.running.runner import run_stage
from pipelines.running.stage_status import read_stage_folders, stage_status
from wsm_data.errors import IntegrityError


def status(out):
    return stage_status(out, read_stage_record(out), held_locks() or {})


def content(folder):
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.rglob("*") if path.is_file()}


def counts(one):
    return one.state, one.listed, one.done, one.refused, one.pending


def test_a_finished_stage_has_counts_and_reasons_and_no_rate(config, source, out):
    (source / "a2.txt").write_text("bad")
    (source / "b1.txt").write_text("partly bad")
    (source / "twin").write_text("")
    run_stage(COPY, config, out, ANY)
    found = status(out)
    assert counts(found) == ("finished", 3, 2, 1, 0)
    assert found.refusals == {"episode.duplicate": 1, "frame.empty": 1, "frame.missing": 1}
    assert (found.refused_parts, found.per_s, found.remaining_s, found.writer) == (2, None, None, None)


def test_looking_changes_no_byte(config, out):
    run_stage(COPY, config, out, ANY)
    before = content(out)
    status(out)
    assert content(out) == before


@pytest.mark.skipif(held_locks() is None, reason="this system has no table of locks")
def test_a_running_stage_is_seen_growing_with_the_process_that_writes_it(config, out):
    seen = []

    def engine(batches, work, processes):
        for batch in batches:
            for outcome in work(batch):
                seen.append(status(out))
                yield outcome

    run_stage(COPY, replace(config, pause_s=0.05), out, ANY, engine)
    assert [counts(one) for one in seen] == [("running", 3, done, 0, 3 - done) for done in range(3)]
    assert {one.writer for one in seen} == {os.getpid()}
    assert (seen[0].per_s, seen[0].remaining_s) == (None, None)  # its line is not written yet
    assert 0 < seen[2].per_s < 20  # at most one in 0.05 s
    assert seen[2].remaining_s == pytest.approx(1 / seen[2].per_s)


def test_a_stage_that_failed_is_unfinished_and_the_unit_pending(config, source, out):
    (source / "a2.txt").write_text("bug")
    with pytest.raises(ValueError, match="a bug in a2"):
        run_stage(COPY, config, out, ANY)
    assert counts(status(out)) == ("unfinished", 3, 1, 0, 2)


def test_units_that_were_not_asked_for_are_pending(config, out):
    run_stage(COPY, config, out, replace(ANY, limit=2))
    assert counts(status(out)) == ("finished", 3, 2, 0, 1)


def test_a_last_line_that_is_being_written_is_passed_over_and_a_damaged_one_is_not(config, out):
    run_stage(COPY, config, out, ANY)
    ledger = out / "ledger.jsonl"
    whole = ledger.read_bytes()
    ledger.write_bytes(whole[:-20])
    assert status(out).done == 2
    ledger.write_bytes(whole.replace(b"done", b"gone", 1))
    with pytest.raises(IntegrityError, match="checksum"):
        status(out)


def test_the_slowest_units_are_those_of_the_ledger(config, source, out):
    (source / "c1.txt").write_text("text of c1")
    run_stage(COPY, config, out, ANY)
    times = {unit: entry.outcome.seconds for unit, entry in read_ledger(out).items()}
    found = status(out)
    assert [one.seconds for one in found.slowest] == sorted(times.values(), reverse=True)[:3]
    assert all(times[one.unit] == one.seconds for one in found.slowest)
    assert found.unit_seconds == pytest.approx(sum(times.values()))


def test_the_ledger_is_read_again_where_it_was_made_one_file_meanwhile(config, out, monkeypatch):
    run_stage(COPY, config, out, ANY)
    answers = [FileNotFoundError(), read_ledger(out)]

    def read(folder):
        answer = answers.pop(0)
        if isinstance(answer, OSError):
            raise answer
        return answer

    monkeypatch.setattr("pipelines.running.stage_status.read_ledger", read)
    assert status(out).done == 3


def test_a_run_and_one_of_its_stages_are_both_taken(config, out):
    run_stage(COPY, config, out, ANY)
    (out.parent / "notes").mkdir()
    assert list(read_stage_folders(out)) == list(read_stage_folders(out.parent)) == [out]
    assert read_stage_folders(out.parent / "notes") == {}
