"""URLs are told from paths, also after `Path` has cut them."""

from pathlib import Path

import pytest

from wsm_data.errors import ConfigError
from wsm_data.files.locations import is_url, require_local, require_no_secret


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


SECRET = "tz8Kq0planted"  # noqa: S105 - invented
WITH_SECRETS = (
    f"ftp://me:{SECRET}@host/release",
    f"https://{SECRET}@host/release",
    f"https://host/release?X-Amz-Algorithm=a&X-Amz-Signature={SECRET}",
    f"https://host/release?AWSAccessKeyId={SECRET}&Expires=1",
    f"https://account.blob/release?sv=2024&sig={SECRET}",
    f"https://host/release?access_token={SECRET}",
    f"hf://datasets/me/hf_{SECRET}{SECRET}",
)


@pytest.mark.parametrize("url", WITH_SECRETS)
def test_a_url_with_a_credential_is_refused_without_showing_it(url):
    with pytest.raises(ConfigError, match="must hold no credentials") as refused:
        require_no_secret(url)
    assert SECRET not in str(refused.value)


@pytest.mark.parametrize("url", WITH_SECRETS)
def test_a_path_that_turns_out_to_be_such_a_url_is_refused_without_showing_it(url):
    with pytest.raises(ConfigError, match="must be a path on this machine") as refused:
        require_local("source", url)
    assert SECRET not in str(refused.value)


@pytest.mark.parametrize(
    "url",
    [
        "s3://bucket/release",
        "hf://datasets/me/homes@main/v1",
        "https://host/release?page=2",
        "abfs://box@account.dfs.core.windows.net/a",
        "/a/b@c",
    ],
)
def test_other_urls_are_taken(url):
    require_no_secret(url)
