"""The table at the end of a run."""

from pathlib import Path

from pipelines.running.stage import REFUSED, Outcome, Settled
from pipelines.running.stage_report import StageReport, stage_report, summary_table
from wsm_data.errors import Reason
from wsm_data.schema.verdict import Refusal


def refusal(unit, reason):
    return Refusal(unit=unit, source="", reason=reason, message="")


def test_outcomes_are_counted_and_numeric_facts_summed():
    settled = Settled(
        outcomes={
            "a": Outcome(unit="a", facts={"frames": 3, "metres": 1.5, "exact": True, "name": "x"}),
            "b": Outcome(unit="b", facts={"frames": 4}, refusals=(refusal("b/1", Reason.POSE_JUMP),)),
            "c": Outcome(unit="c", state=REFUSED, refusals=(refusal("c", Reason.FRAME_EMPTY),)),
            "d": Outcome(unit="d", state=REFUSED, refusals=(refusal("d", Reason.FRAME_EMPTY),)),
        },
        pending=("e",),
    )
    report = stage_report("index", Path("out"), settled, ["a", "b"], 2.5, [refusal("x", Reason.EPISODE_DUPLICATE)])
    assert report == StageReport(
        stage="index",
        out=Path("out"),
        listed=5,
        ran=("a", "b"),
        done=2,
        refused=2,
        pending=1,
        refused_parts=2,
        refusals={"episode.duplicate": 1, "frame.empty": 2, "pose.jump": 1},
        facts={"frames": 7, "metres": 1.5},
        seconds=2.5,
    )


def one(stage, **values):
    given = {"listed": 3, "ran": ("a",), "done": 2, "refused": 1, "pending": 0, "seconds": 12.34, **values}
    return StageReport(stage=stage, out=Path(), **given)


def test_the_table_is_aligned_and_says_refusals_by_reason():
    table = summary_table(
        [
            one("index", refusals={"frame.empty": 1}, facts={"frames": 12345, "metres": 2.5, "bytes": 3_200_000}),
            one("split", listed=1, done=1, refused=0, seconds=0.0),
        ]
    )
    assert table.splitlines() == [
        "stage  units  ran  done  refused  pending  seconds  facts",
        "index      3    1     2        1        0     12.3  frames 12,345, metres 2.50, bytes 3.2 M",
        "split      1    1     1        0        0      0.0",
        "refused, by reason:",
        "  index: 1 x frame.empty",
    ]


def test_without_refusals_nothing_is_said_of_them():
    assert "by reason" not in summary_table([one("split")])


def test_refused_parts_stand_beside_refused_units():
    line = summary_table([one("index", refused_parts=8)]).splitlines()[1]
    assert line.split() == ["index", "3", "1", "2", "1", "+", "8", "parts", "0", "12.3"]


def test_a_stage_that_waits_for_another_is_named():
    last = summary_table([one("map", waits_for=("index",))]).splitlines()[-1]
    assert last == "map will be listed anew once nothing is pending in: index"
