"""`wsm audit-run`: what it prints of the ledgers of small runs."""

import re
from dataclasses import asdict

import numpy as np
import pytest

from pipelines.cli import app
from pipelines.operations.audit_run import audit_run
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.config import OrderConfig, Remainder, SourceConfig
from wsm_data.loaders.ledger.writer import LedgerWriter
from wsm_data.loaders.sources.clips import open_sources

ORDER = OrderConfig(seed=2, global_batch=2, remainder=Remainder.DROP)


def record(folder, release, spans, *, world_size=2, order=ORDER, change=lambda refs: refs):
    """A session that records the steps `first` to `last` of some epochs, as their order says."""
    sources = open_sources([SourceConfig(release=str(release), split="")])
    identity = {"sources": sources.identity(), "order": asdict(order)}
    for rank in range(world_size):
        with LedgerWriter(folder, identity, rank, world_size) as writer:
            for epoch, first, last in spans:
                epoch_order = sources.order_epoch(order, epoch)
                writer.begin(epoch, first, epoch_order.steps)
                for step in range(first, last):
                    writer.record(epoch, step, change(np.concatenate(epoch_order.rows(step, rank, world_size))))
    return sources


def audit(folder, *, releases=(), selections=(), clip=None, epoch=None, step=None):
    audit_run(folder, releases, selections, clip, epoch, step)


@pytest.fixture
def resumed(tmp_path, tiny):
    """Two epochs of three steps: killed after step 2 of the first, resumed from step 1 on one rank."""
    folder = tmp_path / "ledger"
    record(folder, tiny.folder, [(0, 0, 2)])
    record(folder, tiny.folder, [(0, 1, 3), (1, 0, 3)], world_size=1)
    return folder


def test_a_run_that_was_killed_and_resumed_is_proven(resumed, tiny, capsys):
    audit(resumed, releases=[str(tiny.folder)])
    printed = capsys.readouterr().out
    assert "world size 1, 2; 3 files" in printed
    assert re.search(r"0 +3 +3 +6 +6 +0 +1 +dropped clips: 1", printed)
    assert "epoch 0: step 1 of session" in printed
    assert printed.splitlines()[-1] == (
        "2 of 2 epochs complete, no step missing, none twice: every recorded step brought what the order says"
    )


@pytest.mark.parametrize(
    ("remainder", "explained"),
    [(Remainder.DROP, "dropped clips: 1"), (Remainder.REPEAT, "repeated rows: 1"), (Remainder.PAD, "empty rows: 1")],
)
def test_the_remainder_is_explained(tmp_path, tiny, capsys, remainder, explained):
    order = OrderConfig(global_batch=2, remainder=remainder)
    record(tmp_path / "ledger", tiny.folder, [(0, 0, 3 if remainder is Remainder.DROP else 4)], order=order)
    audit(tmp_path / "ledger", releases=[str(tiny.folder)])
    assert explained in capsys.readouterr().out


def test_a_ledger_that_was_switched_on_in_mid_run_proves_what_followed(tmp_path, tiny, capsys):
    record(tmp_path / "ledger", tiny.folder, [(1, 2, 3), (2, 0, 3)])
    audit(tmp_path / "ledger", releases=[str(tiny.folder)])
    printed = capsys.readouterr().out
    assert "the ledger begins with step 2 of epoch 1: it says nothing of what came before" in printed
    assert re.search(r"1 +1 +3 .*not complete", printed)
    assert printed.splitlines()[-1].startswith(
        "1 of 2 epochs complete, no step missing from step 2 of epoch 1 on, none twice"
    )


def test_bytes_of_a_record_that_was_cut_short_are_counted(resumed, tiny, capsys):
    audit(resumed, releases=[str(tiny.folder)])
    assert "cut short" not in capsys.readouterr().out
    with (resumed / "rank-00001.jsonl").open("ab") as file:
        file.write(b'{"clo')
    audit(resumed, releases=[str(tiny.folder)])
    assert "3 files, 0 of them not closed, 5 bytes of records that were cut short" in capsys.readouterr().out


def test_an_epoch_under_way_is_not_complete(tmp_path, tiny, capsys):
    record(tmp_path / "ledger", tiny.folder, [(0, 0, 3), (1, 0, 1)])
    audit(tmp_path / "ledger", releases=[str(tiny.folder)])
    printed = capsys.readouterr().out
    assert "not complete" in printed
    assert printed.splitlines()[-1].startswith("1 of 2 epochs complete")


def test_steps_that_were_skipped_end_with_code_4(tmp_path, tiny, capsys):
    record(tmp_path / "ledger", tiny.folder, [(0, 0, 1)])
    record(tmp_path / "ledger", tiny.folder, [(0, 2, 3)])
    arguments = ["audit-run", str(tmp_path / "ledger"), "--release", str(tiny.folder)]
    with pytest.raises(SystemExit) as stopped:
        app(arguments)
    assert stopped.value.code == IntegrityError.exit_code
    captured = capsys.readouterr()
    assert "epoch 0: step 1 in no session" in captured.err
    assert "clips seen" in captured.out


def test_a_step_that_brought_other_clips_is_shown(tmp_path, tiny, capsys):
    record(tmp_path / "ledger", tiny.folder, [(0, 0, 3)], world_size=1, change=lambda refs: refs[::-1])
    with pytest.raises(IntegrityError, match="epoch 0: step 0 must bring rank 0 of 1 the refs"):
        audit(tmp_path / "ledger", releases=[str(tiny.folder)])
    assert "does not fit" in capsys.readouterr().out


def test_a_run_of_which_no_step_counts_proves_nothing(tmp_path, tiny):
    record(tmp_path / "ledger", tiny.folder, [(0, 0, 0)])
    with pytest.raises(IntegrityError, match="at least one step must have been recorded by all ranks"):
        audit(tmp_path / "ledger", releases=[str(tiny.folder)])


def test_it_says_which_steps_saw_a_clip(resumed, tiny, capsys):
    sources = open_sources([SourceConfig(release=str(tiny.folder), split="")])
    [key] = sources.keys(sources.order_epoch(ORDER, 0).rows(1, 1, 2)[0])  # of step 1, which was trained again
    audit(resumed, releases=[str(tiny.folder)], clip=key)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert [row[:4] for row in rows if row[0] == "0"] == [["0", "1", "1", "2"], ["0", "1", "0", "1"]]
    assert {" ".join(row[5:]) for row in rows if row[3] == "2"} == {"lost with its run, trained again"}
    assert {" ".join(row[5:]) for row in rows if row[3] == "1"} == {""}


def test_a_clip_that_was_not_delivered_is_said(tmp_path, tiny, capsys):
    sources = record(tmp_path / "ledger", tiny.folder, [(0, 0, 1)])
    seen = np.concatenate(sources.order_epoch(ORDER, 0).rows(0, 0, 1)).tolist()
    unseen = sources.keys([ref for ref in range(sources.clips) if ref not in seen])[0]
    audit(tmp_path / "ledger", releases=[str(tiny.folder)], clip=unseen)
    assert capsys.readouterr().out == f"{unseen} was not delivered at any recorded step\n"


def test_it_says_what_a_step_brought(resumed, tiny, capsys):
    audit(resumed, releases=[str(tiny.folder)], epoch=1, step=2)
    sources = open_sources([SourceConfig(release=str(tiny.folder), split="")])
    refs = np.concatenate(sources.order_epoch(ORDER, 1).rows(2, 0, 1)).tolist()
    keys = sources.keys(refs)
    expected = [["0", str(ref), key] for ref, key in zip(refs, keys, strict=True)]
    assert [line.split() for line in capsys.readouterr().out.splitlines()[1:]] == expected


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ({"epoch": 1}, "by --epoch and --step together"),
        ({"step": 1}, "by --epoch and --step together"),
        ({"epoch": 0, "step": 0, "clip": "a"}, "ask for one clip by --clip, or for one step"),
        ({"epoch": 0, "step": 3}, "step 3 of epoch 0 was not recorded by all ranks; there are epochs 0"),
        ({"epoch": 7, "step": 0}, "step 0 of epoch 7 was not recorded"),
    ],
)
def test_a_question_that_cannot_be_answered_is_a_wrong_request(resumed, tiny, question, message):
    with pytest.raises(ConfigError, match=message):
        audit(resumed, releases=[str(tiny.folder)], **question)


def test_a_folder_without_a_ledger_ends_with_code_2(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        app(["audit-run", str(tmp_path), "--release", "anywhere"])
    assert stopped.value.code == ConfigError.exit_code
    assert "there is no ledger in" in capsys.readouterr().err
