import json
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import pytest

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import OrderConfig, SourceConfig
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.sources.state import LoaderState, loader_state, restore, state_to_json

ORDER = OrderConfig(seed=3, global_batch=2)
MakeState = Callable[..., LoaderState]


@pytest.fixture
def make_state(tiny: SimpleNamespace) -> MakeState:
    """The state of a loader over the tiny release, at step 5 of epoch 2 unless asked otherwise."""

    def make(*sources: SourceConfig, order: OrderConfig = ORDER, epoch: int = 2, step: int = 5) -> LoaderState:
        opened = open_sources(sources or [SourceConfig(release=str(tiny.folder))])
        return loader_state(opened, order, epoch=epoch, step=step)

    return make


def test_a_state_that_was_written_to_a_file_is_restored(make_state: MakeState) -> None:
    saved = json.loads(json.dumps(state_to_json(make_state())))
    assert restore(saved, make_state(epoch=0, step=0)) == (2, 5)
    assert saved == state_to_json(make_state())


def test_a_state_is_small_and_knows_no_path(make_state: MakeState, tiny: SimpleNamespace) -> None:
    text = json.dumps(state_to_json(make_state()))
    assert len(text) < 1000
    assert str(tiny.folder) not in text


def test_a_release_that_moved_is_the_same_release(make_state: MakeState, tiny: SimpleNamespace) -> None:
    saved = state_to_json(make_state())
    moved = tiny.folder.rename(tiny.folder.with_name("moved"))
    assert restore(saved, make_state(SourceConfig(release=str(moved)))) == (2, 5)


def test_other_settings_of_the_order_are_told_field_by_field(make_state: MakeState) -> None:
    saved = state_to_json(make_state())
    with pytest.raises(ConfigError) as caught:
        restore(saved, make_state(order=replace(ORDER, seed=4, chunk_sizes=(1, 2))))
    assert "\n  order.chunk_sizes: [1, 2, 3, 4] -> [1, 2]\n  order.seed: 3 -> 4\n" in str(caught.value)


def test_another_release_is_told_by_both_digests(make_state: MakeState, tiny: SimpleNamespace) -> None:
    saved = state_to_json(make_state())
    other = tiny.folder.with_name("other")
    tiny.pack(other, tiny.clips[:-3], shard_bytes=200_000)
    expected = make_state(SourceConfig(release=str(other)))
    now = expected.sources[0]["release_digest"]
    with pytest.raises(ConfigError) as caught:
        restore(saved, expected)
    assert f'sources[0].release_digest: "{saved["sources"][0]["release_digest"]}" -> "{now}"' in str(caught.value)
    assert "sources[0].clips: 5 -> 4" in str(caught.value)


def test_a_source_that_was_added_or_taken_away_is_told(make_state: MakeState, tiny: SimpleNamespace) -> None:
    one = SourceConfig(release=str(tiny.folder))
    two = replace(one, split="test", weight=0.5)
    with pytest.raises(ConfigError, match=r'sources\[1\]: absent -> {"clips": 2, '):
        restore(state_to_json(make_state(one)), make_state(one, two))
    with pytest.raises(ConfigError, match=r"sources\[1\]: {.*} -> absent"):
        restore(state_to_json(make_state(one, two)), make_state(one))
    with pytest.raises(ConfigError, match=r"sources\[1\]\.weight: 0\.5 -> 0\.25\n") as caught:
        restore(state_to_json(make_state(one, two)), make_state(one, replace(two, weight=0.25)))
    assert str(caught.value).count(" -> ") == 1


def test_a_state_of_another_version_is_refused(make_state: MakeState) -> None:
    saved = state_to_json(make_state()) | {"version": 0}
    with pytest.raises(ConfigError, match="version: 0 -> 1"):
        restore(saved, make_state())


@pytest.mark.parametrize("change", [{"step": -1}, {"step": "5"}, {"epoch": True}, {"epoch": None}, {"step": 2.0}])
def test_a_place_that_is_no_number_is_refused(make_state: MakeState, change: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=f"{next(iter(change))} of a saved state must be a number of at least 0"):
        restore(state_to_json(make_state()) | change, make_state())


@pytest.mark.parametrize("record", [{}, {"epoch": 0, "step": 0}, {"loader": "another"}])
def test_what_is_no_state_is_refused(make_state: MakeState, record: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match="can only be restored over the same sources"):
        restore(record, make_state())
