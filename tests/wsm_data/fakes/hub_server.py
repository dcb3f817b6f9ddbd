"""A stand-in of the Hugging Face Hub on a free port: data set repositories, large files, commits and reading by ranges.

It speaks what huggingface_hub speaks: `preupload`, git-lfs batches with basic transfers, `commit` as lines of JSON,
`validate-yaml` of a README.md, `paths-info`, `tree` and `resolve`. Files above `LARGE_BYTES` are large ones. A token is
compared where one is wanted.
"""

import base64
import hashlib
import json
import re
import threading
import urllib.parse
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
import yaml

LARGE_BYTES = 2000
TOKEN = "hf_" + "x" * 34


@dataclass
class HubServer:
    """What the hub has: files by repository and path, large content by sha256, and every request that came."""

    url: str = ""
    token: str = ""
    repositories: dict[str, dict[str, bytes]] = field(default_factory=dict)
    large: dict[str, bytes] = field(default_factory=dict)
    commits: list[list[str]] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    failures: dict[str, int] = field(default_factory=lambda: defaultdict(int))

    def fail(self, pattern: str, times: int) -> None:
        """The next `times` requests that match `METHOD path` are answered by 503."""
        self.failures[pattern] += times

    def uploads(self) -> int:
        return sum(one.startswith("PUT /upload/") for one in self.requests)

    def is_failing(self, request: str) -> bool:
        for pattern, times in self.failures.items():
            if times and re.search(pattern, request):
                self.failures[pattern] -= 1
                return True
        return False


def _described(path: str, data: bytes) -> dict[str, Any]:
    git = hashlib.sha1(b"blob %d\0" % len(data) + data, usedforsecurity=False).hexdigest()
    stated: dict[str, Any] = {"type": "file", "path": path, "size": len(data), "oid": git}
    if len(data) > LARGE_BYTES:
        stated["lfs"] = {"oid": hashlib.sha256(data).hexdigest(), "size": len(data), "pointerSize": 130}
    return stated


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    hub: HubServer

    def _handle(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        path = urllib.parse.unquote(self.path.partition("?")[0])
        self.hub.requests.append(f"{self.command} {path}")
        if self.hub.is_failing(f"{self.command} {path}"):
            self._answer(503, {"error": "busy"})
        elif self.hub.token and self.headers.get("Authorization") != f"Bearer {self.hub.token}":
            self._answer(401, {"error": "Invalid username or password."})
        else:
            self._route(path, body)

    do_GET = do_HEAD = do_POST = do_PUT = _handle

    def _route(self, path: str, body: bytes) -> None:
        for pattern, answer in self._routes().items():
            if found := re.fullmatch(pattern, path):
                answer(body, **found.groupdict())
                return
        self._answer(404, {"error": f"no such path {path}"})

    def _routes(self) -> dict[str, Any]:
        repository = r"(?P<repository>[^/]+/[^/]+)"
        return {
            r"/api/repos/create": self._create,
            r"/api/validate-yaml": self._validate,
            rf"/api/datasets/{repository}/preupload/[^/]+": self._preupload,
            rf"/datasets/{repository}\.git/info/lfs/objects/batch": self._batch,
            r"/upload/(?P<oid>\w+)": self._upload,
            rf"/api/datasets/{repository}/commit/[^/]+": self._commit,
            rf"/api/datasets/{repository}/paths-info/[^/]+": self._paths,
            rf"/api/datasets/{repository}/tree/[^/]+/?(?P<folder>.*)": self._tree,
            rf"/api/datasets/{repository}(?:/revision/[^/]+)?": self._repository,
            rf"/datasets/{repository}/resolve/[^/]+/(?P<path>.+)": self._resolve,
        }

    def _create(self, body: bytes) -> None:
        asked = json.loads(body)
        name = f"{asked.get('organization') or 'me'}/{asked['name']}"
        status = 409 if name in self.hub.repositories else 200
        self.hub.repositories.setdefault(name, {})
        self._answer(status, {"url": f"{self.hub.url}/datasets/{name}", "error": "exists"})

    def _validate(self, body: bytes) -> None:
        card = json.loads(body)["content"]
        try:
            is_sound = isinstance(yaml.safe_load(card.split("---")[1]), dict)
        except (IndexError, yaml.YAMLError):
            is_sound = False
        errors = [] if is_sound else [{"message": "the head of the card must be YAML between lines of ---"}]
        self._answer(200 if is_sound else 400, {"errors": errors, "warnings": []})

    def _preupload(self, body: bytes, repository: str) -> None:
        files = [
            {
                "path": one["path"],
                "uploadMode": "lfs" if one["size"] > LARGE_BYTES else "regular",
                "shouldIgnore": False,
            }
            for one in json.loads(body)["files"]
        ]
        self._of(repository, {"files": files})

    def _batch(self, body: bytes, repository: str) -> None:
        objects = []
        for one in json.loads(body)["objects"]:
            wanted = one["oid"] not in self.hub.large
            actions = {"actions": {"upload": {"href": f"{self.hub.url}/upload/{one['oid']}"}}} if wanted else {}
            objects.append({"oid": one["oid"], "size": one["size"], **actions})
        self._of(repository, {"transfer": "basic", "objects": objects})

    def _upload(self, body: bytes, oid: str) -> None:
        if hashlib.sha256(body).hexdigest() != oid:
            self._answer(400, {"error": "another sha256"})
            return
        self.hub.large[oid] = body
        self._answer(200, {})

    def _commit(self, body: bytes, repository: str) -> None:
        files, paths = self.hub.repositories[repository], []
        for line in body.splitlines():
            entry = json.loads(line)
            value = entry["value"]
            if entry["key"] == "file":
                files[value["path"]] = base64.b64decode(value["content"])
            elif entry["key"] == "lfsFile":
                files[value["path"]] = self.hub.large[value["oid"]]
            elif entry["key"] == "deletedFile":
                del files[value["path"]]
            paths += [value["path"]] if "path" in value else []
        self.hub.commits.append(paths)
        url = f"{self.hub.url}/datasets/{repository}/commit/{'0' * 40}"
        self._of(repository, {"success": True, "commitOid": "0" * 40, "commitUrl": url})

    def _paths(self, body: bytes, repository: str) -> None:
        asked = json.loads(body) if body.startswith(b"{") else urllib.parse.parse_qs(body.decode())
        files = self.hub.repositories.get(repository, {})
        self._of(repository, [_described(path, files[path]) for path in asked["paths"] if path in files])

    def _tree(self, body: bytes, repository: str, folder: str) -> None:
        prefix = f"{folder}/" if folder else ""
        found: dict[str, dict[str, Any]] = {}
        for path, data in self.hub.repositories.get(repository, {}).items():
            if path.startswith(prefix):
                name, below, _ = path.removeprefix(prefix).partition("/")
                stated = _described(path, data)
                found[name] = {"type": "directory", "path": prefix + name, "size": 0, "oid": "0"} if below else stated
        if folder and not found:
            self._answer(404, {"error": "no such folder"}, {"X-Error-Code": "EntryNotFound"})
        else:
            self._of(repository, list(found.values()))

    def _repository(self, body: bytes, repository: str) -> None:
        self._of(repository, {"id": repository, "sha": "0" * 40, "siblings": [], "private": True, "tags": []})

    def _resolve(self, body: bytes, repository: str, path: str) -> None:
        data = self.hub.repositories.get(repository, {}).get(path)
        if data is None:
            self._answer(404, {"error": "no such file"}, {"X-Error-Code": "EntryNotFound"})
            return
        span = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        begin, end = (int(span[1]), int(span[2] or len(data) - 1) + 1) if span else (0, len(data))
        headers = {"ETag": '"x"', "X-Repo-Commit": "0" * 40, "Content-Range": f"bytes {begin}-{end - 1}/{len(data)}"}
        self._send(206 if span else 200, data[begin:end], headers)

    def _of(self, repository: str, answer: object) -> None:
        if repository in self.hub.repositories:
            self._answer(200, answer)
        else:
            self._answer(404, {"error": "Repository not found"}, {"X-Error-Code": "RepoNotFound"})

    def _answer(self, status: int, answer: object, headers: dict[str, str] | None = None) -> None:
        self._send(status, json.dumps(answer).encode(), {"Content-Type": "application/json", **(headers or {})})

    def _send(self, status: int, body: bytes, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Nothing: requests are recorded."""


@pytest.fixture
def hub(monkeypatch: pytest.MonkeyPatch) -> Iterator[HubServer]:
    """An empty hub, where huggingface_hub looks for the real one."""
    from huggingface_hub import constants

    hub = HubServer()
    handler = type("Handler", (_Handler,), {"hub": hub})
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    hub.url = f"http://127.0.0.1:{server.server_address[1]}"
    monkeypatch.setattr(constants, "ENDPOINT", hub.url)
    monkeypatch.setattr(constants, "HUGGINGFACE_CO_URL_TEMPLATE", hub.url + "/{repo_id}/resolve/{revision}/{filename}")
    monkeypatch.setattr(constants, "HF_HUB_DISABLE_XET", True)
    monkeypatch.setenv("HF_TOKEN", TOKEN)
    yield hub
    server.shutdown()
    thread.join(timeout=10)
    server.server_close()
