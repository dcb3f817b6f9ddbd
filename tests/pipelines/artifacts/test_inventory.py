"""The account of a run: whatever went in stands in it once, and a release made of it passes its own check."""

from types import SimpleNamespace

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.artifacts.episode_table import EpisodeRow, write_episodes
from pipelines.artifacts.inventory import account_of
from pipelines.running.folder import StageRecord
from pipelines.running.quarantine import write_pending, write_quarantine
from wsm_data.errors import Reason
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.verdict import Refusal
from wsm_data.shards.conservation import check_conservation
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.inventory import InventoryRow, UnitState, parse_inventory, write_inventory

SCENE = "box_zed/hall"
RECORD = StageRecord(name="index", version=1, settings={}, config={}, fingerprint="f", inputs={}, seen={})
FOLDER, ARCHIVE = SCENE, f"{SCENE}.tar.gz"


def unit(number):
    return f"{SCENE}/{number:06d}"


def refusal(name, source, reason=Reason.FRAME_EMPTY):
    return Refusal(unit=name, source=source, reason=reason, message=f"{name} is bad", details={"frame": 3})


class Stages:
    """The folders of `index` and `encode`, as far as the account reads them."""

    def __init__(self, root):
        self.index, self.encode = root / "index", root / "encode"
        self.clips = {}

    def indexed(self, accepted=(), refused=(), pending=()):
        rows = [
            EpisodeRow(
                id=EpisodeId.parse(name),
                container=source,
                digest=f"content of {name}",
                record_digest="r",
                frames=5,
                floor_z_m=0.0,
            )
            for name, source in accepted
        ]
        write_episodes(self.index, rows)
        write_quarantine(self.index, RECORD, refused)
        write_pending(self.index, pending)

    def encoded(self, clips=(), refused=()):
        self.clips = {name: f"content of {name}" for name in clips}
        write_quarantine(self.encode, RECORD, refused)

    def account(self):
        splits = dict.fromkeys(self.clips, "train")
        return account_of(self.index, self.encode, splits, self.clips)


@pytest.fixture
def stages(tmp_path):
    return Stages(tmp_path)


def findings(account, clips, partial=True):
    """What the release's own check of the books says of an account."""
    names = ("key", "split", "shard", "source_digest")
    columns = [(EpisodeId.parse(name).key, "train", "train-000000.tar", digest) for name, digest in clips.items()]
    table = pa.table({name: pa.array([row[i] for row in columns], pa.string()) for i, name in enumerate(names)})
    manifest = SimpleNamespace(partial=partial)
    found = check_conservation(manifest, IndexTable(table), account.rows, account.quarantine)
    return [(str(one.kind), one.clip) for one in found]


def told(account):
    return {(row.unit, row.container, str(row.state), row.reason) for row in account.rows}


def test_a_clip_stands_with_its_split_and_content_and_without_its_container(stages):
    """Where it came from tells the layout of the source, on which a release does not depend."""
    stages.indexed(accepted=[(unit(0), FOLDER)])
    stages.encoded(clips=[unit(0)])
    account = stages.account()
    (row,) = account.rows
    assert row == InventoryRow(
        unit=unit(0), container="", state=UnitState.CLIP, split="train", source_digest=f"content of {unit(0)}"
    )
    assert account.quarantine == ()
    assert findings(account, stages.clips, partial=False) == []


def test_every_kind_of_thing_that_went_in_stands_in_it_once(stages):
    stages.indexed(
        accepted=[(unit(0), FOLDER), (unit(1), FOLDER), (unit(2), FOLDER)],
        refused=[
            refusal(unit(3), FOLDER),
            refusal(unit(0), ARCHIVE, Reason.EPISODE_DUPLICATE),
            refusal("box_zed/loft.tar.gz", "box_zed/loft.tar.gz", Reason.ARCHIVE_TRUNCATED),
        ],
        pending=["box_zed/den"],
    )
    stages.encoded(clips=[unit(0)], refused=[refusal(unit(1), FOLDER, Reason.GOAL_UNREACHABLE)])
    account = stages.account()
    assert told(account) == {
        (unit(0), "", "clip", ""),
        (unit(1), FOLDER, "refused", "goal.unreachable"),
        (unit(2), FOLDER, "pending", ""),
        (unit(3), FOLDER, "refused", "frame.empty"),
        (unit(0), ARCHIVE, "refused", "episode.duplicate"),
        ("box_zed/loft.tar.gz", "box_zed/loft.tar.gz", "refused", "archive.truncated"),
        ("box_zed/den", "box_zed/den", "pending", ""),
    }
    assert len(account.rows) == 7
    assert findings(account, stages.clips) == []


def test_what_is_pending_is_found_in_a_release_that_does_not_say_that_it_is_partial(stages):
    stages.indexed(accepted=[(unit(0), FOLDER), (unit(1), FOLDER)], pending=["box_zed/den"])
    stages.encoded(clips=[unit(0)])
    found = findings(stages.account(), stages.clips, partial=False)
    assert sorted(found) == [("unit.lost", "box_zed/den"), ("unit.lost", unit(1))]


def test_the_quarantine_holds_every_refusal_with_its_stage_and_without_time(stages):
    stages.indexed(accepted=[(unit(0), FOLDER), (unit(1), FOLDER)], refused=[refusal(unit(3), FOLDER)])
    stages.encoded(clips=[unit(0)], refused=[refusal(unit(1), FOLDER, Reason.GOAL_UNREACHABLE)])
    account = stages.account()
    assert [(line["unit"], line["stage"], line["reason"]) for line in account.quarantine] == [
        (unit(3), "index", "frame.empty"),
        (unit(1), "encode", "goal.unreachable"),
    ]
    for line in account.quarantine:
        assert set(line) == {"unit", "source", "reason", "message", "details", "stage"}


def test_a_trajectory_that_is_refused_in_one_container_and_kept_from_another_stands_for_both(stages):
    stages.indexed(accepted=[(unit(0), FOLDER)], refused=[refusal(unit(0), ARCHIVE)])
    stages.encoded(clips=[unit(0)])
    account = stages.account()
    assert told(account) == {(unit(0), "", "clip", ""), (f"{unit(0)}@{ARCHIVE}", ARCHIVE, "refused", "frame.empty")}
    assert findings(account, stages.clips, partial=False) == []


def test_a_trajectory_that_is_refused_in_two_containers_stands_for_both(stages):
    stages.indexed(refused=[refusal(unit(0), ARCHIVE), refusal(unit(0), FOLDER)])
    stages.encoded()
    account = stages.account()
    assert {row.unit for row in account.rows} == {unit(0), f"{unit(0)}@{ARCHIVE}"}
    assert findings(account, {}, partial=False) == []


def test_a_trajectory_that_stands_twice_in_one_container_and_of_which_neither_is_kept_is_refused_once(stages):
    """Which of the two is meant cannot be told, so the reader keeps none: a duplicate with no other of its name."""
    stages.indexed(accepted=[(unit(1), ARCHIVE)], refused=[refusal(unit(0), ARCHIVE, Reason.EPISODE_DUPLICATE)])
    stages.encoded(clips=[unit(1)])
    account = stages.account()
    assert (unit(0), ARCHIVE, "refused", "episode.duplicate") in told(account)
    assert findings(account, stages.clips, partial=False) == []


@pytest.mark.parametrize("state", ["pending", "refused"])
def test_a_container_that_is_called_like_a_trajectory_is_told_apart_from_it(stages, state):
    """The trajectory folder hall/000003 is a container, and hall/000003 is also the id of what is in it."""
    container = unit(3)
    stages.indexed(
        accepted=[(unit(3), ARCHIVE)],
        pending=[container] if state == "pending" else [],
        refused=[refusal(container, container, Reason.CONTAINER_NO_EPISODES)] if state == "refused" else [],
    )
    stages.encoded(clips=[unit(3)])
    account = stages.account()
    assert {row.unit for row in account.rows} == {unit(3), f"{unit(3)}@{container}"}
    assert findings(account, stages.clips) == []


def test_a_pending_container_that_is_called_like_a_refused_trajectory_is_told_apart_from_it(stages):
    stages.indexed(refused=[refusal(unit(3), ARCHIVE)], pending=[unit(3)])
    stages.encoded()
    account = stages.account()
    assert told(account) == {
        (unit(3), unit(3), "pending", ""),
        (f"{unit(3)}@{ARCHIVE}", ARCHIVE, "refused", "frame.empty"),
    }
    assert findings(account, {}) == []


def test_what_encode_refused_of_a_trajectory_that_has_left_the_source_is_left_out(stages):
    stages.indexed(accepted=[(unit(0), FOLDER)])
    stages.encoded(clips=[unit(0)], refused=[refusal(unit(1), FOLDER)])
    account = stages.account()
    assert {row.unit for row in account.rows} == {unit(0)}
    assert findings(account, stages.clips, partial=False) == []


CONTAINERS = (FOLDER, ARCHIVE, unit(0), unit(1))
FATES = st.sampled_from(["kept", "refused", "twice"])
CONTENT = st.one_of(
    st.just("pending"), st.just("refused"), st.dictionaries(st.integers(0, 3), FATES, min_size=1, max_size=4)
)


@given(
    contents=st.fixed_dictionaries(dict.fromkeys(CONTAINERS, CONTENT)),
    encoded=st.lists(st.sampled_from(["clip", "refused", "pending"]), min_size=4, max_size=4),
)
def test_whatever_became_of_a_source_nothing_is_lost_or_counted_twice(contents, encoded, tmp_path_factory):
    """Containers of any content, after the rules of `index`: the first container by name keeps a trajectory.

    Two of the containers are called like trajectories; what stands twice in one container is kept from neither.
    """
    stages = Stages(tmp_path_factory.mktemp("run"))
    accepted, refused, entered = {}, [], 0
    for container, content in sorted(contents.items()):
        entered += len(content) if isinstance(content, dict) else 1
        if content == "refused":
            refused.append(refusal(container, container, Reason.ARCHIVE_TRUNCATED))
        for number, fate in content.items() if isinstance(content, dict) else ():
            if fate != "kept":
                reason = Reason.EPISODE_DUPLICATE if fate == "twice" else Reason.FRAME_EMPTY
                refused.append(refusal(unit(number), container, reason))
            elif accepted.setdefault(unit(number), container) != container:
                refused.append(refusal(unit(number), container, Reason.EPISODE_DUPLICATE))
    pending = [container for container, content in contents.items() if content == "pending"]
    stages.indexed(accepted=list(accepted.items()), refused=refused, pending=pending)
    fates = dict(zip(sorted(accepted), encoded, strict=False))
    stages.encoded(
        clips=[name for name, fate in fates.items() if fate == "clip"],
        refused=[refusal(name, accepted[name]) for name, fate in fates.items() if fate == "refused"],
    )
    account = stages.account()
    assert len(account.rows) == entered
    assert findings(account, stages.clips) == []
    assert sum(row.state is UnitState.REFUSED for row in account.rows) == len(account.quarantine)


def test_the_account_survives_the_files_of_a_release(stages, tmp_path):
    stages.indexed(accepted=[(unit(0), FOLDER)], refused=[refusal(unit(3), FOLDER)], pending=["box_zed/den"])
    stages.encoded(clips=[unit(0)])
    account = stages.account()
    write_inventory(tmp_path / "inventory.parquet", account.rows)
    read = parse_inventory((tmp_path / "inventory.parquet").read_bytes(), "inventory")
    assert sorted(read, key=lambda row: row.unit) == sorted(account.rows, key=lambda row: row.unit)
