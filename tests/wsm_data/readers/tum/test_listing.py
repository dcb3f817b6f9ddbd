import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.tum.listing import data_lines, read_listing


def test_comments_and_empty_lines_are_no_images_and_times_are_sorted(tmp_path):
    (tmp_path / "rgb.txt").write_text("# color images\n\n2.5 rgb/b.png\n  # more\n1.25\trgb/a.png\n")
    listing = read_listing(tmp_path, "rgb.txt", "s")
    assert (listing.stamps_s.tolist(), listing.names) == ([1.25, 2.5], ("rgb/a.png", "rgb/b.png"))


def test_a_pattern_takes_the_last_number_of_a_name_as_its_time(tmp_path):
    (tmp_path / "results").mkdir()
    for name in ("frame000010.jpg", "frame000002.jpg", "depth000001.png"):
        (tmp_path / "results" / name).write_bytes(b"")
    listing = read_listing(tmp_path, "results/frame*.jpg", "s")
    assert listing.stamps_s.tolist() == [2.0, 10.0]
    assert listing.names == ("results/frame000002.jpg", "results/frame000010.jpg")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1.0\n", "line 1 .* `stamp file`"),
        ("# one\nnow a.png\n", "line 2 .* `stamp file`"),
        ("1 a.png extra\n", "`stamp file`"),
        ("1 /etc/a.png\n", "a file of the sequence"),
        ("1 ../a.png\n", "a file of the sequence"),
        ("nan a.png\n", "a time"),
        ("1 a.png\n1.0 b.png\n", "time 1.0 twice"),
        ("# nothing\n", "names none"),
    ],
)
def test_a_list_that_is_none_is_refused_with_its_line(tmp_path, text, said):
    (tmp_path / "rgb.txt").write_text(text)
    with pytest.raises(DataError, match=said) as caught:
        read_listing(tmp_path, "rgb.txt", "s")
    assert caught.value.reason is Reason.SEQUENCE_UNREADABLE


def test_an_absent_list_is_unreadable_and_bytes_are_no_text(tmp_path):
    with pytest.raises(DataError) as caught:
        read_listing(tmp_path, "rgb.txt", "s")
    assert caught.value.reason is Reason.FILE_UNREADABLE
    (tmp_path / "rgb.txt").write_bytes(b"\xff\xfe1 a\n")
    with pytest.raises(DataError, match="must be text") as caught:
        data_lines(tmp_path, "rgb.txt", "s")
    assert caught.value.reason is Reason.SEQUENCE_UNREADABLE


def test_a_file_without_a_number_does_not_fit_a_pattern(tmp_path):
    (tmp_path / "first.png").write_bytes(b"")
    with pytest.raises(DataError, match=r"first\.png has no number"):
        read_listing(tmp_path, "*.png", "s")
