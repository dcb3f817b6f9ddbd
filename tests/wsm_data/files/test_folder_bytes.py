from wsm_data.files.folder_bytes import folder_bytes


def test_files_at_any_depth_count_and_what_is_not_there_is_nothing(tmp_path):
    (tmp_path / "a/b").mkdir(parents=True)
    (tmp_path / "a/one").write_bytes(b"12")
    (tmp_path / "a/b/two").write_bytes(b"345")
    assert [folder_bytes(tmp_path / name) for name in ("a", "a/b", "a/one", "absent")] == [5, 3, 2, 0]
