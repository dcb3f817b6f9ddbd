import re
from types import SimpleNamespace

from wsm_data.access.notebook import release_html
from wsm_data.access.release import open_release


def test_a_release_whose_codec_is_not_here_says_so_in_place_of_pictures(tiny: SimpleNamespace) -> None:
    html = release_html(open_release(tiny.folder))  # its codec has a digest of its own, which nothing decodes
    assert "<img" not in html
    assert "was encoded with codec" in html


def test_the_first_frames_of_some_clips_are_shown_with_their_keys(homes_release) -> None:
    release = open_release(homes_release)
    html = release._repr_html_()
    assert 0 < html.count("data:image/png;base64,") <= 8
    captions = re.findall(r"anywhere'>(.*?)</figcaption>", html)
    assert set(captions) <= set(release.keys())
    assert captions == sorted(set(captions), key=release.keys().index)
