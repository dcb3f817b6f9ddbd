"""A release in a local S3 (moto as a server) behind the fault proxy; all listen on free ports of the loopback."""

import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from fault_proxy import FaultProxy
from tiny_release import build_clip, pack

from wsm_data.access.release import open_release
from wsm_data.access.shard_reader import Span
from wsm_data.loaders.config import ReadConfig
from wsm_data.shards.manifest import ReleaseManifest

CLIPS = 24
SHARD_BYTES = 400_000  # four to six clips
BUCKET = "releases"


@dataclass(frozen=True)
class Published:
    """A release that lies in a local folder and, with the same bytes, in the object store.

    Attributes:
        folder: the local one.
        url: the one behind the proxy.
        manifest: dataset.json of both.
        spans: where each clip stands, in the order of the index.
    """

    folder: Path
    url: str
    manifest: ReleaseManifest
    spans: tuple[Span, ...]

    def bytes_of(self, span: Span) -> bytes:
        return (self.folder / span.shard).read_bytes()[span.offset : span.end]


@dataclass(frozen=True)
class Remote:
    """The published release through a proxy of this test alone."""

    published: Published
    proxy: FaultProxy

    @property
    def url(self) -> str:
        return self.published.url

    def read(self, **changes: object) -> ReadConfig:
        """Settings that fail fast."""
        return ReadConfig(**{"first_backoff_s": 0.01, "request_timeout_s": 10.0, "fetch_threads": 4} | changes)


@pytest.fixture(scope="session")
def store_server() -> Iterator[tuple[str, int]]:
    """Host and port of an empty S3."""
    from moto.server import ThreadedMotoServer  # slow to import: only tests that need a store wait for it

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    yield server.get_host_and_port()
    server.stop()


@pytest.fixture(scope="session")
def published(store_server: tuple[str, int], tmp_path_factory: pytest.TempPathFactory) -> Published:
    folder = tmp_path_factory.mktemp("published") / "release"
    units = [f"synth_d435i/home_{number // 6:04d}/{number:06d}" for number in range(CLIPS)]
    manifest = pack(
        folder,
        [build_clip(unit, latents=3 + number % 3) for number, unit in enumerate(units)],
        shard_bytes=SHARD_BYTES,
    )
    upload(folder, store_server)
    index = open_release(folder).index
    columns = zip(index.texts("shard"), index.numbers("clip_offset"), index.numbers("clip_size"), strict=True)
    spans = tuple(Span(shard, int(offset), int(size)) for shard, offset, size in columns)
    return Published(folder, f"s3://{BUCKET}/tiny", manifest, spans)


def upload(folder: Path, server: tuple[str, int], prefix: str = "tiny") -> None:
    """Put all files of a folder into the bucket."""
    client = _client(server)
    client.create_bucket(Bucket=BUCKET)
    for path in sorted(folder.iterdir()):
        client.upload_file(str(path), BUCKET, f"{prefix}/{path.name}")
    client.close()


def _client(server: tuple[str, int]) -> Any:
    import boto3

    host, port = server
    return boto3.client(
        "s3",
        endpoint_url=f"http://{host}:{port}",
        region_name="us-east-1",
        aws_access_key_id="test",
        aws_secret_access_key="test",  # noqa: S106 - moto asks for one and checks none
    )


@pytest.fixture
def store_proxy(store_server: tuple[str, int], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[FaultProxy]:
    """The object store through a proxy of this test alone, reached as users reach theirs: by the environment."""
    with FaultProxy(store_server) as proxy:
        monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.url)
        monkeypatch.setenv("AWS_ACCESS_KEY_ID", "test")
        monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "test")
        monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "absent"))
        monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "absent"))
        monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
        yield proxy


@pytest.fixture
def bucket(store_proxy: FaultProxy, store_server: tuple[str, int]) -> Iterator[tuple[str, Any]]:
    """URL of an empty bucket behind the proxy, and a client of boto3 that reaches it without."""
    client = _client(store_server)
    name = f"empty-{uuid.uuid4().hex[:12]}"
    client.create_bucket(Bucket=name)
    yield f"s3://{name}", client
    client.close()


@pytest.fixture
def remote(published: Published, store_proxy: FaultProxy) -> Remote:
    """The published release."""
    return Remote(published, store_proxy)


@pytest.fixture(params=["http", pytest.param("s3", marks=pytest.mark.slow)])
def address(request: pytest.FixtureRequest, remote: Remote) -> str:
    """URL of the published release; a client of S3 takes a tenth of a second of computing to make."""
    return remote.url if request.param == "s3" else f"{remote.proxy.url}/{BUCKET}/tiny"
