from wsm_data.shards.manifest import release_digest
from wsm_data.view.release.text import describe_release


def test_it_lists_groups_scenes_shards_and_drops(release):
    text = describe_release(release)
    lines = [line.split() for line in text.splitlines()]
    assert ["digest", release_digest(release.manifest)] in lines
    assert ["synth_d435i", "d435i", "3", "27", "3", "0"] in lines
    assert ["synth_zed", "zed", "2", "27", "0", "3"] in lines
    assert "1 of 2 held-out scenes occur in training too, with 2 held-out clips" in text
    for shard in release.manifest.shards:
        assert any(line[:3] == [shard.name, shard.split, str(shard.clips)] for line in lines if line)
    assert ["path.through_obstacle", "2", "synth_d435i/home_0002/000007", "first"] in lines


def test_a_partial_release_says_so(tmp_path, made):
    release = made.release(tmp_path, {"a_d435i/home/000000": "train"}, refusals=(), partial=True)
    text = describe_release(release)
    assert "partial" in text
    assert "nothing was dropped" in text


def test_no_line_ends_in_blanks(release):
    assert all(line == line.rstrip() for line in describe_release(release).splitlines())
