"""Archives are read in sequential passes, at most twice in a whole run, and never unpacked."""

from collections import Counter

from wsm_data.readers.archive import tar_stream, tar_walk


def test_an_archive_is_opened_twice_in_a_run_and_nothing_is_unpacked(make_source, run_pipeline, tmp_path, monkeypatch):
    opened: Counter[str] = Counter()

    def counting(path, where):
        opened[path.name] += 1
        return tar_stream.open_tar(path, where)

    monkeypatch.setattr(tar_walk, "open_tar", counting)
    source = make_source(layout="scene_archive", cameras=("d435i",))
    run_pipeline(source, tmp_path / "run")
    assert opened == {"home_0001.tar.gz": 2}
    assert not [path for path in (tmp_path / "run").rglob("*") if path.suffix in (".jpg", ".png", ".ply", ".mp4")]
    assert [path.name for path in source.rglob("*") if path.is_file()] == ["home_0001.tar.gz"]
