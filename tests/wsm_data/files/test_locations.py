"""URLs are told from paths, also after `Path` has cut them."""

from pathlib import Path

import pytest

from wsm_data.errors import ConfigError
from wsm_data.files.locations import is_url, require_local


def test_urls_are_told_from_paths():
    assert [is_url(text) for text in ("s3://bucket/x", "file:///x", "/x", "x/y")] == [True, True, False, False]


@pytest.mark.parametrize("url", ["s3://bucket/tree", "gs://a", "memory://x"])
def test_a_url_where_a_folder_is_needed_is_refused_as_it_was_typed(url):
    for given in (url, Path(url)):
        with pytest.raises(ConfigError, match=f"--out must be a path on this machine, found the URL {url}; copy or"):
            require_local("--out", given)


@pytest.mark.parametrize("path", ["/data/a:b", "a", "../a", "/data/s3:/b", "C:/x"])
def test_any_path_is_taken(path):
    require_local("--out", Path(path))
    require_local("--out", path)
