"""Files put into a data set repository of the Hugging Face Hub: content first, then one commit that shows all of it.

The token is the hub's own business: the environment variable HF_TOKEN, or what `hf auth login` left.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.locations import require_no_secret
from wsm_data.files.retries import Answer, RequestConfig, ask
from wsm_data.files.uploads.local_file import LocalFile

if TYPE_CHECKING:
    from huggingface_hub import CommitOperationAdd, CommitOperationDelete, HfApi
    from huggingface_hub.hf_api import RepoFile

HUB_SCHEME = "hf://"
_DATASETS = f"{HUB_SCHEME}datasets/"
_REPOSITORY_PARTS = 2
_REQUEST = RequestConfig(attempts=3)  # huggingface_hub asks several times itself


class HubTarget:
    """A folder of a data set repository, as hf://datasets/NAMESPACE/NAME[@REVISION][/FOLDER]."""

    def __init__(self, url: str):
        """Name the repository; it is made where there is none, and private then.

        Raises:
            ConfigError: it is no such URL, it holds a token, or huggingface_hub is not installed.
        """
        require_no_secret(url)
        self._hub = _client(url)
        self._url = url.rstrip("/")
        self._repository, self._revision, self._folder = _parsed(self._url)
        self._waiting: dict[str, tuple[CommitOperationAdd, LocalFile] | CommitOperationDelete] = {}
        self._is_there = False

    @property
    def store(self) -> FsspecStore:
        """The folder, to read from; a new one each time, for it keeps listings."""
        return FsspecStore(self._url)

    def holds(self, name: str, file: LocalFile) -> bool:
        """Whether the hub has exactly these bytes, by the digest that it names them by."""
        stated = self._stated(name)
        return stated is not None and _digest(stated) in (file.sha256, file.git_sha1)

    def put(self, name: str, file: LocalFile) -> None:
        """Upload the content of a file; it stands in the repository after `settle`.

        Raises:
            StoreError: the hub refuses, or failed.
        """
        from huggingface_hub import CommitOperationAdd

        operation = CommitOperationAdd(path_in_repo=self._place(name), path_or_fileobj=str(file.path))
        self._make()
        self._ask(
            name,
            lambda: self._hub.preupload_lfs_files(
                self._repository, [operation], repo_type="dataset", revision=self._revision, free_memory=False
            ),
        )
        self._waiting[name] = (operation, file)

    def remove(self, name: str) -> None:
        """Take a file away with the next `settle`; nothing where there is none."""
        from huggingface_hub import CommitOperationDelete

        if self._stated(name) is not None:
            self._waiting[name] = CommitOperationDelete(path_in_repo=self._place(name), is_folder=False)

    def settle(self) -> None:
        """Make one commit of all that was put and removed.

        Raises:
            StoreError: the hub refuses, failed, or has other bytes afterwards.
        """
        if not self._waiting:
            return
        operations = [one[0] if isinstance(one, tuple) else one for one in self._waiting.values()]
        self._ask(
            "",
            lambda: self._hub.create_commit(
                self._repository,
                operations,
                commit_message=f"{len(operations)} files of a release",
                repo_type="dataset",
                revision=self._revision,
            ),
        )
        waited, self._waiting = self._waiting, {}
        for name, one in waited.items():
            if isinstance(one, tuple) and not self.holds(name, one[1]):
                raise StoreError(f"{self._url}/{name} must be the file {one[1].path} after the commit, and is not")

    def checksum(self, name: str) -> str:
        """The digest that the hub names the bytes of a file by."""
        stated = self._stated(name)
        return f"hub:{_digest(stated)}" if stated else ""

    def _make(self) -> None:
        if not self._is_there:
            self._ask(
                "",
                lambda: self._hub.create_repo(self._repository, repo_type="dataset", private=True, exist_ok=True),
            )
            self._is_there = True

    def _ask(self, name: str, request: Callable[[], Answer]) -> Answer:
        def unwrapped() -> Answer:
            try:
                return request()
            except RuntimeError as error:  # its threads that upload wrap what they meet
                raise error.__cause__ or error from error

        return ask(unwrapped, f"{self._url}/{name}" if name else self._url, _REQUEST)

    def _stated(self, name: str) -> "RepoFile | None":
        from huggingface_hub.errors import RepositoryNotFoundError, RevisionNotFoundError
        from huggingface_hub.hf_api import RepoFile

        try:
            found = self._ask(
                name,
                lambda: self._hub.get_paths_info(
                    self._repository, self._place(name), repo_type="dataset", revision=self._revision
                ),
            )
        except StoreError as error:
            if isinstance(error.__cause__, RepositoryNotFoundError | RevisionNotFoundError):
                return None
            raise
        return next((one for one in found if isinstance(one, RepoFile)), None)

    def _place(self, name: str) -> str:
        return f"{self._folder}/{name}" if self._folder else name


def _client(url: str) -> "HfApi":
    """The client of the hub, which asks for nothing that a mirror of the hub need not know.

    Raises:
        ConfigError: huggingface_hub is not installed.
    """
    try:
        from huggingface_hub import HfApi
    except ModuleNotFoundError as error:
        raise ConfigError(f"{url} needs huggingface_hub: pip install 'wsm[hub]'") from error

    client = HfApi()
    # Before a commit the library asks the hub whether the head of README.md is valid. A server that does not know the
    # question would fail the whole commit, and so would one that answers anything but JSON. The hub looks at the head
    # again in the commit itself, and our card is made, not typed.
    client._validate_yaml = _not_asked
    return client


def _not_asked(*_: object, **__: object) -> None:
    """In the place of a question."""


def _parsed(url: str) -> tuple[str, str | None, str]:
    """Repository, revision and folder of a URL."""
    parts = url.removeprefix(_DATASETS).split("/")
    if not url.startswith(_DATASETS) or len(parts) < _REPOSITORY_PARTS or not all(parts):
        raise ConfigError(f"{url} must name a data set, as hf://datasets/NAMESPACE/NAME")
    name, _, revision = parts[1].partition("@")
    return f"{parts[0]}/{name}", revision or None, "/".join(parts[_REPOSITORY_PARTS:])


def _digest(stated: "RepoFile") -> str:
    """sha256 of a large file, git's SHA-1 of a small one."""
    return stated.lfs.sha256 if stated.lfs else stated.blob_id
