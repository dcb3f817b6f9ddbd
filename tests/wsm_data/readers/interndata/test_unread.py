from wsm_data.readers.interndata.naming import Kind
from wsm_data.readers.interndata.unread import Unread


def noted(*names):
    unread = Unread()
    for name in names:
        unread.note(name)
    return unread


def test_images_under_other_names_are_counted_and_the_first_is_shown_with_the_form_that_is_read():
    advice = noted("videos/b/frame_1.JPG", "videos/b/frame_0.jpg", "videos/depth/0.exr", "meta/x.json").advice(Kind.RGB)
    assert advice.startswith("2 other files are there, such as 'videos/b/frame_0.jpg'")
    assert "observation.images.rgb/episode_000000_0.jpg" in advice


def test_where_nothing_looks_like_them_the_scene_is_to_be_fetched():
    assert noted("meta/info.json").advice(Kind.DEPTH) == "fetch the scene again"
    assert Unread().summary() == "no file at all"


def test_backslashes_are_named():
    assert "backslashes" in noted("home\\data\\chunk-000\\episode_000000.parquet").summary()
