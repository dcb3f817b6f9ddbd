import contextlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.readers.lerobot.meta import INFO_FILE, read_info, read_places

RGB = "observation.images.rgb"
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


def test_every_episode_is_placed_in_its_files_and_time(lerobot_root, walks):
    info = read_info(lerobot_root)
    places = read_places(lerobot_root, info, [RGB])
    assert [place.length for place in places.values()] == [len(walk.rgb) for walk in walks]
    for place in places.values():
        file, begins_s = place.videos[RGB]
        assert (lerobot_root / place.data_file).is_file()
        assert (lerobot_root / file).is_file()
        assert begins_s == (0.6 if info.version == 3 and place.index else 0.0)  # 6 frames at 10 Hz


def damaged(tmp_path, **changes):
    said = {"codebase_version": "v2.1", "fps": 10, "features": {}, "data_path": "d/{episode_index:06d}", **changes}
    (tmp_path / "meta").mkdir(exist_ok=True)
    (tmp_path / INFO_FILE).write_text(json.dumps(said))
    (tmp_path / "meta" / "episodes.jsonl").write_text('{"episode_index": 0, "length": 5}\n')
    return tmp_path


@pytest.mark.parametrize("changes", [{"codebase_version": "v1.6"}, {"fps": 0}, {"features": 3}, {"fps": "x"}])
def test_a_description_of_another_kind_is_refused(tmp_path, changes):
    with pytest.raises(DataError, match="must describe a LeRobot data set") as caught:
        read_info(damaged(tmp_path, **changes))
    assert caught.value.reason is Reason.SEQUENCE_UNREADABLE


@pytest.mark.parametrize("template", ["/etc/passwd", "../{episode_index}", "{nothing}", "{0.__class__}", "", "{}"])
def test_a_template_that_leads_out_of_the_data_set_is_refused(tmp_path, template):
    root = damaged(tmp_path, data_path=template)
    with pytest.raises(DataError) as caught:
        read_places(root, read_info(root), [])
    assert caught.value.reason is Reason.SEQUENCE_UNREADABLE


@settings(max_examples=60, deadline=None)
@given(said=JSON, line=JSON)
def test_whatever_stands_in_the_meta_files_is_read_or_refused(tmp_path_factory, said, line):
    root = damaged(tmp_path_factory.mktemp("any"))
    if isinstance(said, dict):
        damaged(root, **said)
    else:
        (root / INFO_FILE).write_text(json.dumps(said))
    (root / "meta" / "episodes.jsonl").write_text(json.dumps(line))
    with contextlib.suppress(DataError):
        read_places(root, read_info(root), [])
