import os

from wsm_data.readers.folder_signature import folder_signature


def test_a_signature_changes_with_name_size_and_time_of_any_file_and_with_nothing_else(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "one").write_bytes(b"1")
    os.utime(tmp_path / "a" / "one", ns=(5, 5))
    first = folder_signature(tmp_path)
    (tmp_path / ".hidden").write_bytes(b"2")
    assert folder_signature(tmp_path) == first
    os.utime(tmp_path / "a" / "one", ns=(5, 6))
    touched = folder_signature(tmp_path)
    (tmp_path / "a" / "one").rename(tmp_path / "a" / "two")
    assert len({first, touched, folder_signature(tmp_path)}) == 3


def test_a_link_that_leads_nowhere_counts_with_its_error(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    broken = folder_signature(tmp_path)
    (tmp_path / "link").unlink()
    assert folder_signature(tmp_path) != broken
