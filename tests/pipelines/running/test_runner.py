"""The stage runner: what is done, what is done again, what is refused, and what is left when it is cut short."""

from dataclasses import replace

import pytest
from fake_runs import ANY, copies
from fake_stages import COPY, COPY_VERSION_2, JOIN, CopyConfig, JoinConfig, Letters

from pipelines.running.folder import read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.runner import run_stage
from wsm_data.errors import BudgetExceeded, ConfigError, WsmError
from wsm_data.files.jsonlines import read_lines


def refused_units(out):
    return [(line["unit"], line["reason"]) for line in read_lines(out / "quarantine.jsonl")]


def pending(out):
    return [line["unit"] for line in read_lines(out / "pending.jsonl")]


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# what is done, and done again


def test_every_unit_is_done_once_and_then_the_stage_is_finished(config, out, calls):
    report = run_stage(COPY, config, out, ANY)
    assert calls() == ["a1", "a2", "b1", "finish"]
    assert copies(out) == {name: f"text of {name}" for name in ("a1", "a2", "b1")}
    assert (report.listed, report.done, report.refused, report.pending) == (3, 3, 0, 0)
    assert report.facts["bytes"] == 3 * len("text of a1")


def test_a_second_run_does_nothing_and_leaves_every_byte_alone(config, out, calls):
    run_stage(COPY, config, out, ANY)
    before = content(out)
    calls()
    report = run_stage(COPY, config, out, ANY)
    assert (calls(), report.ran, report.done) == ([], (), 3)
    assert content(out) == before


def test_with_a_changed_input_exactly_that_unit_is_done_again(config, out, calls):
    run_stage(COPY, config, out, ANY)
    calls()
    (config.source / "a2.txt").write_text("other")
    assert run_stage(COPY, config, out, ANY).ran == ("a2",)
    assert calls() == ["a2", "finish"]
    assert copies(out)["a2"] == "other"


def test_a_unit_whose_output_is_missing_is_done_again_and_the_stage_finished_again(config, out, calls):
    run_stage(COPY, config, out, ANY)
    finished = read_stage_record(out).finished
    calls()
    (out / "copies" / "b1.txt").unlink()
    run_stage(COPY, config, out, ANY)
    assert calls() == ["b1", "finish"]
    assert copies(out)["b1"] == "text of b1"
    assert read_stage_record(out).finished == finished


def test_a_unit_whose_output_has_another_size_is_done_again(config, out, calls):
    run_stage(COPY, config, out, ANY)
    calls()
    (out / "copies" / "b1.txt").write_text("cut")
    assert run_stage(COPY, config, out, ANY).ran == ("b1",)
    assert copies(out)["b1"] == "text of b1"


@pytest.mark.parametrize("name", ["words.json", "quarantine.jsonl", "pending.jsonl"])
def test_what_finish_wrote_is_written_again_when_it_is_gone(config, out, calls, name):
    run_stage(COPY, config, out, ANY)
    before = content(out)
    calls()
    (out / name).unlink()
    assert run_stage(COPY, config, out, ANY).ran == ()
    assert calls() == ["finish"]
    assert content(out) == before


def test_what_finish_wrote_is_written_again_when_it_has_another_size(config, out):
    run_stage(COPY, config, out, ANY)
    before = (out / "words.json").read_bytes()
    (out / "words.json").write_bytes(before[:-1])
    run_stage(COPY, config, out, ANY)
    assert (out / "words.json").read_bytes() == before


def test_changed_units_that_a_limited_run_does_not_come_to_keep_their_outputs(config, out):
    run_stage(COPY, config, out, ANY)
    for name in ("a2", "b1"):
        (config.source / f"{name}.txt").write_text("other")
    run_stage(COPY, config, out, replace(ANY, limit=1))
    assert copies(out) == {"a1": "text of a1", "a2": "other", "b1": "text of b1"}
    assert set(read_ledger(out)) == {"a1", "a2"}
    (config.source / "b1.txt").write_text("text of b1")
    report = run_stage(COPY, config, out, ANY)
    assert (report.ran, report.done) == ((), 3)
    assert set(read_ledger(out)) == {"a1", "a2", "b1"}


def test_finish_is_called_again_when_what_it_alone_reads_changed(config, out, calls):
    told = {"manifest": "1"}
    stage = replace(COPY, finish_inputs=lambda _: told)
    run_stage(stage, config, out, ANY)
    run_stage(stage, config, out, ANY)
    calls()
    told["manifest"] = "2"
    assert run_stage(stage, config, out, ANY).ran == ()
    assert calls() == ["finish"]


def test_a_unit_that_left_the_source_leaves_the_folder_with_its_files_and_nothing_is_worked_on(config, out, calls):
    run_stage(COPY, config, out, ANY)
    calls()
    (config.source / "a1.txt").unlink()
    run_stage(COPY, config, out, ANY)
    assert calls() == ["finish"]
    assert set(copies(out)) == set(read_ledger(out)) == {"a2", "b1"}


def test_a_source_that_was_moved_is_not_worked_on_again_but_the_record_says_where_it_is(config, out, calls, tmp_path):
    run_stage(COPY, config, out, ANY)
    calls()
    moved = config.source.rename(tmp_path / "moved")
    assert run_stage(COPY, CopyConfig(source=moved), out, replace(ANY, workers=2)).ran == ()
    assert calls() == []
    assert read_stage_record(out).config["source"] == str(moved)
    assert read_stage_record(out).workers == 1  # of the run that did the work


def test_the_record_finds_an_input_from_any_folder(config, out, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    run_stage(COPY, replace(config, source=config.source.relative_to(tmp_path)), out, ANY)
    assert read_stage_record(out).config["source"] == str(tmp_path / "source")


def test_a_speed_setting_is_no_reason_to_work_again(config, out, calls):
    run_stage(COPY, config, out, ANY)
    calls()
    assert run_stage(COPY, replace(config, batched=True), out, ANY).ran == ()
    assert calls() == []


def test_the_listing_is_the_same_however_finish_is_reached(config, out, tmp_path):
    whole, resumed = tmp_path / "whole", out
    run_stage(COPY, config, whole, ANY)
    run_stage(COPY, config, resumed, replace(ANY, only=("a*",)))
    run_stage(COPY, config, resumed, ANY)
    assert (resumed / "words.json").read_bytes() == (whole / "words.json").read_bytes()


# settings and versions


def test_changed_settings_are_refused_with_both_values(config, out, calls):
    run_stage(COPY, config, out, ANY)
    before = content(out)
    calls()
    changed = replace(config, letters=Letters.UPPER, repeat=2)
    with pytest.raises(ConfigError, match=r'letters: "as_they_are" -> "upper"\n  repeat: 1 -> 2\n'):
        run_stage(COPY, changed, out, ANY)
    assert (calls(), content(out)) == ([], before)


def test_a_fork_writes_changed_settings_beside_and_goes_on_there(config, out):
    run_stage(COPY, config, out, ANY)
    before = content(out)
    forking = replace(ANY, fork=True)
    report = run_stage(COPY, replace(config, repeat=2), out, forking)
    assert report.out != out
    assert report.out.parent == out.parent
    assert copies(report.out)["a1"] == "text of a1" * 2
    assert content(out) == before
    again = run_stage(COPY, replace(config, repeat=2), out, forking)
    assert (again.out, again.ran) == (report.out, ())


def test_a_fork_with_the_same_settings_stays_in_the_folder(config, out):
    run_stage(COPY, config, out, ANY)
    assert run_stage(COPY, config, out, replace(ANY, fork=True)).out == out


def test_another_version_of_the_stage_is_refused_with_both_versions(config, out):
    run_stage(COPY, config, out, ANY)
    with pytest.raises(ConfigError, match="version of the stage: 1 -> 2"):
        run_stage(COPY_VERSION_2, config, out, ANY)


def test_the_folder_of_another_stage_is_refused(config, out):
    run_stage(COPY, config, out, ANY)
    with pytest.raises(ConfigError, match="holds the output of `wsm copy`, not of `wsm join`"):
        run_stage(JOIN, JoinConfig(copy=out), out, ANY)


# selection


def test_ten_first_and_now_all_share_a_folder(config, out, calls):
    first = run_stage(COPY, config, out, replace(ANY, limit=1))
    assert (first.ran, first.pending) == (("a1",), 2)
    assert pending(out) == ["a2", "b1"]
    run_stage(COPY, config, out, replace(ANY, limit=1))
    run_stage(COPY, config, out, ANY)
    assert calls() == ["a1", "finish", "a2", "finish", "b1", "finish"]
    assert pending(out) == []


def test_a_unit_that_came_and_was_not_asked_for_is_pending(config, out, calls):
    run_stage(COPY, config, out, ANY)
    calls()
    (config.source / "c1.txt").touch()
    run_stage(COPY, config, out, replace(ANY, only=("a*",)))
    assert calls() == ["finish"]
    assert pending(out) == ["c1"]


def test_only_takes_patterns_of_unit_ids(config, out):
    assert run_stage(COPY, config, out, replace(ANY, only=("b*", "a1"))).ran == ("a1", "b1")


def test_a_dry_run_says_what_would_be_done_and_writes_nothing(config, out, calls):
    report = run_stage(COPY, config, out, replace(ANY, dry_run=True))
    assert (report.ran, report.pending) == (("a1", "a2", "b1"), 3)
    assert calls() == []
    assert not out.parent.exists()


def test_a_dry_run_leaves_a_folder_as_it_is(config, out):
    run_stage(COPY, config, out, ANY)
    (config.source / "a1.txt").write_text("other")
    before = content(out)
    assert run_stage(COPY, config, out, replace(ANY, dry_run=True)).ran == ("a1",)
    assert content(out) == before


# refusals


def test_one_bad_unit_is_quarantined_and_the_rest_goes_on(config, out):
    (config.source / "a2.txt").write_text("bad")
    report = run_stage(COPY, config, out, ANY)
    assert (report.done, report.refused, report.refusals) == (2, 1, {"frame.empty": 1})
    (line,) = read_lines(out / "quarantine.jsonl")
    assert {**line, "time": 0} == {
        "unit": "a2",
        "source": "a2.txt",
        "stage": "copy",
        "stage_version": 1,
        "fingerprint": read_stage_record(out).fingerprint,
        "reason": "frame.empty",
        "message": "a2 is bad",
        "details": {"bytes": 0},
        "time": 0,
    }


def test_an_error_that_escapes_a_batch_refuses_the_units_that_have_no_outcome_yet(config, out):
    (config.source / "a2.txt").write_text("bad")
    (config.source / "a3.txt").write_text("never reached")
    run_stage(COPY, replace(config, batched=True), out, ANY)
    assert refused_units(out) == [("a2", "frame.empty"), ("a3", "frame.empty")]
    assert set(copies(out)) == {"a1", "b1"}


@pytest.mark.parametrize(("workers", "sizes"), [(1, [2, 1, 3]), (2, [3, 2, 1])])
def test_several_workers_are_given_the_largest_batches_first(config, out, workers, sizes):
    for name in ("c1", "c2", "c3"):
        (config.source / f"{name}.txt").write_text(name)
    given = []

    def engine(tasks, work, count):
        given.extend(len(task) for task in tasks)
        assert count == workers
        for task in tasks:
            yield from work(task)

    run_stage(COPY, replace(config, batched=True), out, replace(ANY, workers=workers), engine)
    assert given == sizes


def test_a_refused_part_of_a_done_unit_stands_in_the_quarantine_and_in_the_report(config, out):
    (config.source / "a1.txt").write_text("partly bad")
    report = run_stage(COPY, config, out, ANY)
    assert (report.refused, report.refused_parts, report.refusals) == (0, 1, {"frame.missing": 1})
    assert refused_units(out) == [("a1/part", "frame.missing")]


@pytest.mark.parametrize(("max_refused", "stops"), [(0, True), (0.3, True), (0.4, False), (1, False)])
def test_refused_parts_count_against_the_budget_and_downstream_sees_no_end(config, out, max_refused, stops):
    """`copy` does not count parts, so they are judged by its three units: one is 0.33 of them."""
    (config.source / "a1.txt").write_text("partly bad")
    if not stops:
        assert run_stage(COPY, config, out, replace(ANY, max_refused=max_refused)).done == 3
        return
    with pytest.raises(BudgetExceeded, match=r"copy: 1 of 3 parts were refused.* a1/part \(frame.missing: one frame\)"):
        run_stage(COPY, config, out, replace(ANY, max_refused=max_refused))
    assert refused_units(out) == [("a1/part", "frame.missing")]
    assert not read_stage_record(out).finished
    assert run_stage(COPY, config, out, ANY).ran == ()


def test_where_parts_are_counted_a_share_is_one_of_the_parts(config, out):
    """Each byte stands for a part: 10 + 5 + 4 were kept and one was refused, a twentieth."""
    counting = replace(COPY, parts_fact="bytes")
    for name, text in (("a1", "partly bad"), ("a2", "12345"), ("b1", "1234")):
        (config.source / f"{name}.txt").write_text(text)
    with pytest.raises(BudgetExceeded, match=r"copy: 1 of 20 bytes were refused, more than --max-refused 0\.04"):
        run_stage(counting, config, out, replace(ANY, max_refused=0.04))
    assert run_stage(counting, config, out, replace(ANY, max_refused=0.05)).done == 3


def test_what_finish_refuses_counts_against_the_budget(config, out):
    (config.source / "twin").touch()
    with pytest.raises(BudgetExceeded, match=r"1 of 3 parts were refused.*twin \(episode.duplicate: found twice\)"):
        run_stage(COPY, config, out, replace(ANY, max_refused=0.1))
    assert run_stage(COPY, config, out, replace(ANY, max_refused=1)).refused_parts == 1


def test_what_finish_refuses_stands_in_the_quarantine_too(config, out):
    (config.source / "twin").touch()
    run_stage(COPY, config, out, ANY)
    assert refused_units(out) == [("twin", "episode.duplicate")]


def test_a_refused_unit_is_left_alone_until_it_is_asked_for_or_mended(config, out, calls):
    (config.source / "a2.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    calls()
    run_stage(COPY, config, out, ANY)
    assert calls() == []
    run_stage(COPY, config, out, replace(ANY, retry_refused=True))
    assert calls() == ["a2", "finish"]
    (config.source / "a2.txt").write_text("mended")
    run_stage(COPY, config, out, ANY)
    assert calls() == ["a2", "finish"]
    assert refused_units(out) == []


def test_the_output_of_a_unit_that_turned_bad_is_deleted(config, out):
    run_stage(COPY, config, out, ANY)
    (config.source / "a2.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    assert set(copies(out)) == {"a1", "b1"}


@pytest.mark.parametrize(("max_refused", "allowed"), [(0, 0), (0.4, 1), (0.7, 2), (1, 1), (2, 2)])
def test_the_budget_is_a_share_below_one_and_a_number_from_one_on(config, out, max_refused, allowed):
    options = replace(ANY, max_refused=max_refused)
    for name in ("a1", "a2", "b1")[: allowed + 1]:
        (config.source / f"{name}.txt").write_text("bad")
    with pytest.raises(BudgetExceeded, match=f"copy: {allowed + 1} of 3 units were refused"):
        run_stage(COPY, config, out, options)
    (config.source / "a1.txt").write_text("mended")
    assert run_stage(COPY, config, out, options).refused == allowed


def test_past_the_budget_the_reasons_are_written_down_and_nothing_is_lost(config, out, calls):
    (config.source / "a2.txt").write_text("bad")
    with pytest.raises(BudgetExceeded):
        run_stage(COPY, config, out, replace(ANY, max_refused=0))
    assert refused_units(out) == [("a2", "frame.empty")]
    assert not read_stage_record(out).finished
    run_stage(COPY, config, out, replace(ANY, max_refused=1))
    assert calls() == ["a1", "a2", "b1", "finish"]


def test_running_again_past_the_budget_is_refused_again_even_when_nothing_is_left_to_do(config, out, calls):
    (config.source / "b1.txt").write_text("bad")
    for _ in range(2):
        with pytest.raises(BudgetExceeded):
            run_stage(COPY, config, out, replace(ANY, max_refused=0))
    assert calls() == ["a1", "a2", "b1"]


# mistakes of a stage


def test_units_with_one_id_are_named(config, out):
    twice = replace(COPY, list_units=lambda config: [*COPY.list_units(config), *COPY.list_units(config)])
    with pytest.raises(WsmError, match="copy: unit ids must be unique, found twice: a1, a2, b1"):
        run_stage(twice, config, out, ANY)


def test_a_stage_that_forgets_a_unit_is_a_bug(config, out):
    (config.source / "a2.txt").write_text("forgotten")
    with pytest.raises(RuntimeError, match="copy gave no outcome for a2"):
        run_stage(COPY, config, out, ANY)


def test_a_stage_that_gives_a_unit_twice_is_a_bug(config, out):
    (config.source / "a2.txt").write_text("given twice")
    with pytest.raises(RuntimeError, match="copy gave an outcome too many, for a2"):
        run_stage(COPY, config, out, ANY)
