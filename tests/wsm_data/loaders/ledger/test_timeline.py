import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.ledger.files import ledger_file_name
from wsm_data.loaders.ledger.timeline import read_timeline, steps_text
from wsm_data.loaders.ledger.writer import LedgerWriter

STEPS, BATCH = 6, 4


def refs_of(epoch, step, rank, world_size):
    """A ref that says where it was delivered, for each slot of a rank."""
    share = BATCH // world_size
    slots = np.arange(rank * share, (rank + 1) * share)
    return 10_000 * epoch + 100 * step + slots


def run_rank(folder, rank, world_size, start, end, steps=STEPS):
    """One process of one rank: from a start on it records until `end`, then it is killed."""
    writer = LedgerWriter(folder, {"run": 1}, rank, world_size)
    epoch, step = start
    while (epoch, step) <= end:
        writer.begin(epoch, step, steps)
        for number in range(step, min(steps, end[1]) if epoch == end[0] else steps):
            writer.record(epoch, number, refs_of(epoch, number, rank, world_size))
        epoch, step = epoch + 1, 0
    writer._journal.close()  # nothing is said at the end: as if killed
    writer._file = None


def run_session(folder, world_size, start, ends):
    """All ranks of a session, each killed at its own end; the last ranks write first."""
    for rank in reversed(range(world_size)):
        run_rank(folder, rank, world_size, start, ends[rank] if isinstance(ends, list) else ends)


def delivered(timeline):
    return {
        (record.epoch, step): np.concatenate(refs).tolist()
        for record in timeline.epochs
        for step, refs in record.by_step()
    }


def course(*spans):
    """What an uninterrupted course over (epoch, first, last) delivers."""
    return {
        (epoch, step): refs_of(epoch, step, 0, 1).tolist() for epoch, start, end in spans for step in range(start, end)
    }


def test_one_session_over_two_epochs_is_taken_as_it_is(tmp_path):
    run_session(tmp_path, 2, (0, 0), (1, 4))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6), (1, 0, 4))
    assert [(one.epoch, one.recorded, one.steps) for one in timeline.epochs] == [(0, 6, 6), (1, 4, 6)]
    assert (timeline.misfits, timeline.again, timeline.ahead) == ((), (), 0)


def test_a_resume_overrides_what_was_recorded_from_there_on(tmp_path):
    run_session(tmp_path, 2, (0, 0), [(0, 5), (0, 4)])
    run_session(tmp_path, 2, (0, 3), (0, 6))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6))
    assert [(one.epoch, one.start, one.end) for one in timeline.again] == [(0, 3, 5)]
    assert timeline.misfits == ()


def test_a_resume_may_change_the_world_size_and_change_it_back(tmp_path):
    run_session(tmp_path, 2, (0, 0), (0, 3))
    run_session(tmp_path, 4, (0, 2), [(0, 5), (0, 6), (0, 5), (0, 5)])
    run_session(tmp_path, 2, (0, 4), (1, 1))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6), (1, 0, 1))
    assert [len(stretch.segments) for stretch in timeline.epochs[0].stretches] == [2, 4, 2]
    assert timeline.misfits == ()


def test_a_resume_in_an_earlier_epoch_takes_the_later_one_back(tmp_path):
    run_session(tmp_path, 2, (0, 0), (1, 3))
    run_session(tmp_path, 1, (0, 5), (0, 6))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6))
    assert [(one.epoch, one.start, one.end) for one in timeline.again] == [(0, 5, 6), (1, 0, 3)]


def test_a_resume_at_the_end_of_an_epoch_goes_on_with_the_next(tmp_path):
    run_session(tmp_path, 2, (0, 0), (0, 6))
    run_session(tmp_path, 2, (0, 6), (1, 2))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6), (1, 0, 2))
    assert timeline.misfits == ()


def test_steps_that_only_some_ranks_reached_do_not_count_while_nothing_follows(tmp_path):
    run_session(tmp_path, 2, (0, 0), [(1, 1), (0, 5)])
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 5))
    assert timeline.ahead == 2
    assert timeline.misfits == ()


def test_a_session_that_was_killed_before_it_recorded_changes_nothing(tmp_path):
    run_session(tmp_path, 2, (0, 0), (0, 4))
    run_session(tmp_path, 2, (0, 3), (0, 3))
    run_session(tmp_path, 2, (0, 3), (0, 6))
    timeline = read_timeline(tmp_path)
    assert delivered(timeline) == course((0, 0, 6))
    assert timeline.misfits == ()


def test_a_rank_that_was_killed_before_its_head_was_whole_is_passed_over(tmp_path):
    run_session(tmp_path, 1, (0, 0), (0, 6))
    (tmp_path / "rank-00000.000001.jsonl").write_bytes(b'{"identity"')
    assert len(read_timeline(tmp_path).files) == 1


@pytest.mark.parametrize(
    ("sessions", "message"),
    [
        ([(2, (0, 0), (0, 3)), (2, (0, 4), (0, 6))], "epoch 0: step 3 in no session"),
        ([(2, (0, 0), (0, 3)), (2, (1, 0), (1, 6))], "epoch 0: steps 3 to 5 in no session"),
        ([(2, (0, 0), (0, 6)), (2, (1, 2), (1, 6))], "epoch 1: it was begun at step 2 after epoch 0"),
        ([(2, (0, 0), (0, 6)), (2, (2, 0), (2, 6))], "epoch 2: it was begun at step 0 after epoch 0"),
        ([(2, (0, 0), [(0, 4), (0, 3)]), (2, (0, 4), (0, 6))], "but rank 1 stops before 3"),
        ([(2, (0, 0), (0, 3)), (2, (0, 5), (0, 5))], "epoch 0: steps 3 to 4 in no session"),
    ],
)
def test_what_breaks_the_course_is_said(tmp_path, sessions, message):
    for world_size, start, ends in sessions:
        run_session(tmp_path, world_size, start, ends)
    assert [misfit for misfit in read_timeline(tmp_path).misfits if message in misfit]


@pytest.mark.parametrize("start", [(0, 2), (3, 0), (3, 5)])
def test_a_ledger_may_begin_in_mid_run(tmp_path, start):
    run_session(tmp_path, 2, start, (4, 1))
    timeline = read_timeline(tmp_path)
    assert (timeline.epochs[0].epoch, timeline.epochs[0].start) == start
    assert timeline.misfits == ()
    assert min(delivered(timeline)) == start


@pytest.mark.parametrize(("rank", "number"), [(0, 0), (0, 1), (1, 0)])
def test_a_file_that_was_taken_away_is_missed(tmp_path, rank, number):
    for start in (0, 2, 4):
        run_session(tmp_path, 2, (0, start), (0, start + 2))
    name, following = (ledger_file_name(rank, one) for one in (number, number + 1))
    (tmp_path / name).unlink()
    message = f"{name} must be in the ledger, as {following} is"
    assert [misfit for misfit in read_timeline(tmp_path).misfits if message in misfit]


def test_ranks_that_started_elsewhere_do_not_count_as_one_session(tmp_path):
    run_rank(tmp_path, 0, 2, (0, 0), (0, 4))
    run_rank(tmp_path, 1, 2, (0, 1), (0, 4))
    run_session(tmp_path, 2, (0, 4), (0, 6))
    misfits = read_timeline(tmp_path).misfits
    assert any("steps 0 to 3 from a start at 0 of 6 on, but rank 1 has no such start" in one for one in misfits)


def test_a_session_without_rank_0_is_no_course(tmp_path):
    run_rank(tmp_path, 1, 2, (0, 0), (0, 4))
    assert read_timeline(tmp_path).misfits == (
        "rank 0 must have recorded where it started, but the ledger has no start of it",
    )


def test_an_epoch_does_not_change_its_length(tmp_path):
    run_rank(tmp_path, 0, 1, (0, 0), (0, 3))
    run_rank(tmp_path, 0, 1, (0, 3), (0, 5), steps=5)
    assert read_timeline(tmp_path).misfits == ("epoch 0: it has 6 steps, but 5 from step 3 on",)


def test_files_of_two_runs_in_one_folder_are_refused(tmp_path):
    for number in (1, 2):
        with LedgerWriter(tmp_path / str(number), {"run": number}, 0, 1) as writer:
            writer.begin(0, 0, 1)
    (tmp_path / "1" / "rank-00000.jsonl").rename(tmp_path / "2" / "rank-00000.000001.jsonl")
    with pytest.raises(IntegrityError, match="are of different runs"):
        read_timeline(tmp_path / "2")


def test_a_folder_without_a_ledger_is_a_wrong_request(tmp_path):
    with pytest.raises(ConfigError, match="there is no ledger in"):
        read_timeline(tmp_path)


def position(step):
    return divmod(step, STEPS)


@given(
    st.lists(
        st.tuples(st.sampled_from([1, 2, 4]), st.integers(0, 9), st.lists(st.integers(0, 3), min_size=4, max_size=4)),
        min_size=1,
        max_size=5,
    )
)
def test_whatever_is_killed_and_resumed_within_what_all_ranks_had_the_course_is_whole(tmp_path_factory, sessions):
    """Each session goes some steps beyond a common point, its ranks differently far; the next starts at any step
    before that point, as a checkpoint would."""
    folder = tmp_path_factory.mktemp("run")
    reached = 0
    for world_size, back, beyond in sessions:
        start = max(0, reached - back)
        common = start + 4
        ends = [position(common + beyond[rank] - min(beyond[:world_size])) for rank in range(world_size)]
        run_session(folder, world_size, position(start), ends)
        reached = common
    timeline = read_timeline(folder)
    expected = {position(step): refs_of(*position(step), 0, 1).tolist() for step in range(reached)}
    assert delivered(timeline) == expected
    assert timeline.misfits == ()


def test_steps_are_named_by_the_first_and_the_last():
    assert [steps_text(3, end) for end in (4, 5, 9)] == ["step 3", "steps 3 to 4", "steps 3 to 8"]
