import json
import re
import shutil

import pytest
from box_room import along_x

from pipelines.artifacts.plan_file import Estimate, Plan, write_plan
from pipelines.stages.report import REPORT_FILE, planned_and_actual, stage_summaries
from wsm_data.curation.audit.finding import Check
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.files.sealed import sealed, unsealed

ZED = "box_zed/hall"


@pytest.fixture
def copied(make_pipeline, finished):
    """A copy of the finished run, without its report."""
    pipeline = make_pipeline({})
    shutil.copytree(finished.run_folder, pipeline.run_folder)
    shutil.rmtree(pipeline.folder("report"))
    return pipeline


def page(pipeline):
    return (pipeline.folder("report") / REPORT_FILE).read_text()


def test_the_report_is_one_file_that_needs_nothing_else(finished):
    (outcome,) = finished.outcomes("report").values()
    path = finished.folder("report") / REPORT_FILE
    assert outcome.outputs == (REPORT_FILE,)
    assert outcome.digest == sha256_file(path)
    assert outcome.facts == {"bytes": path.stat().st_size, "clips shown": 1, "audit errors": 0}
    html = page(finished)
    assert html.lower().startswith("<!doctype html>")
    assert not re.search(r'(?:src|href)="(?!data:|#)', html)


def test_the_report_shows_the_stages_that_made_the_release(copied):
    copied.run("report")
    html = page(copied)
    for stage in ("index", "split", "map", "encode", "pack", "verify"):
        assert re.search(rf"<t[dh][^>]*>\s*{stage}\s*<", html), stage


def test_the_report_shows_what_an_audit_finds_unless_it_is_not_asked_for(copied):
    copied.run("report")
    html = page(copied)
    assert [one for one in Check if f"<code>{one.value}</code>" not in html] == []
    shutil.rmtree(copied.folder("report"))
    copied.run("report", audit=False)
    assert "no audit was asked for" in page(copied)


def test_the_summaries_count_what_the_ledgers_hold(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x(), 1: along_x(y_m=1.7)}, True)}, split={"test_fraction": 0.0})
    pipeline.run_to("pack")
    found = {one.name: one for one in stage_summaries(pipeline.run_folder)}
    assert list(found) == ["index", "split", "map", "encode", "pack"]
    encode = found["encode"]
    assert (encode.units, encode.done, encode.refused, encode.pending, encode.workers) == (2, 1, 1, 0, 1)
    assert 0 < encode.wall_seconds <= encode.seconds + 0.01  # one worker, times in milliseconds
    assert encode.seconds == pytest.approx(sum(one.seconds for one in pipeline.outcomes("encode").values()))


def test_a_stage_that_was_cut_short_is_not_told_as_if_it_had_finished(copied):
    record = copied.folder("encode") / "stage.json"
    cut_short = unsealed(json.loads(record.read_text())) | {"finished": ""}
    record.write_text(json.dumps(sealed(cut_short)))
    assert "encode" not in {one.name for one in stage_summaries(copied.run_folder)}


def test_what_is_pending_is_counted(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index", options={"limit": 1})
    (summary,) = stage_summaries(pipeline.run_folder)
    assert (summary.units, summary.done, summary.pending) == (3, 1, 2)


def test_a_plan_is_set_against_what_came_of_it(copied, changed):
    before = copied.inputs("report")
    one = Estimate(value=2.0, low=1.0, high=4.0)
    hours = {"index": one, "encode": one, "score": one, "report": one}
    counts = {"workers": 1, "measured_workers": 1, "gpus": 0, "containers": 3, "sampled_containers": 3}
    known = {"recipe": "r", "source": "s", "bytes_in": 1, "sampled_bytes": 1}
    plan = Plan(**counts, **known, bytes_out=one, peak_disk_bytes=one, hours=one, stage_hours=hours)
    write_plan(copied.run_folder, plan)
    assert changed(before, copied.inputs("report")) == {"report": {"stages"}}
    stages = stage_summaries(copied.run_folder)
    rows = {row.name: row for row in planned_and_actual(copied.run_folder, copied.release, stages)}
    assert list(rows) == ["index, s", "encode, s", "score, s", "release, MiB", "run folder, MiB"]
    assert (rows["encode, s"].low, rows["encode, s"].value, rows["encode, s"].high) == (3600.0, 7200.0, 14400.0)
    assert rows["encode, s"].actual == {one.name: one.wall_seconds for one in stages}["encode"]
    assert rows["score, s"].actual is None  # it never ran
    size = sum(path.stat().st_size for path in copied.release.rglob("*") if path.is_file())
    assert rows["release, MiB"].actual == pytest.approx(size / 2**20)
    assert rows["release, MiB"].off == pytest.approx(size / 2 - 1)


def test_a_folder_that_holds_no_run_has_no_stages(tmp_path):
    assert stage_summaries(tmp_path) == ()


def test_a_second_run_writes_nothing(finished):
    before = page(finished)
    assert finished.run("report").ran == ()
    assert page(finished) == before


def test_a_release_away_from_its_run_is_shown_without_stages_or_with_those_it_is_told(copied, tmp_path, changed):
    elsewhere = tmp_path / "elsewhere" / "deep" / "release"
    shutil.copytree(copied.release, elsewhere)
    alone, told = ({"release": str(elsewhere), "run": run} for run in ("", str(copied.run_folder)))
    assert changed(copied.inputs("report"), copied.inputs("report", **told)) == {}
    assert changed(copied.inputs("report"), copied.inputs("report", **alone)) == {"report": {"stages"}}
    copied.run("report", **alone)
    assert not re.search(r"<t[dh][^>]*>\s*encode\s*<", page(copied))


def test_a_stage_that_ran_since_and_a_release_that_was_packed_since_are_shown(copied, changed):
    before = copied.inputs("report")
    shutil.rmtree(copied.folder("verify"))
    assert changed(before, copied.inputs("report")) == {"report": {"stages"}}
    shutil.rmtree(copied.folder("pack"))
    copied.run("pack", name="another")
    assert changed(before, copied.inputs("report")) == {"report": {"stages", "manifest"}}


def test_the_report_itself_is_no_reason_to_write_it_again(copied, finished, changed):
    before = copied.inputs("report")
    shutil.copytree(finished.folder("report"), copied.folder("report"))
    assert changed(before, copied.inputs("report")) == {}


def test_a_release_that_is_not_there_is_a_wrong_request(make_pipeline):
    with pytest.raises(ConfigError, match="there is no release at"):
        make_pipeline({}).run("report")


def test_an_unfinished_release_is_not_reported(copied):
    (copied.release / "dataset.json").unlink()
    with pytest.raises(IntegrityError, match="the release is unfinished"):
        copied.run("report")


def test_a_damaged_release_is_not_reported(copied):
    index = copied.release / "index.parquet"
    data = bytearray(index.read_bytes())
    data[len(data) // 2] ^= 1
    index.write_bytes(bytes(data))
    with pytest.raises(IntegrityError, match=r"index\.parquet must have sha256"):
        copied.run("report")
    assert not (copied.folder("report") / REPORT_FILE).exists()
