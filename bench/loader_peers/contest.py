"""Environments, stored clips and processes of all contestants, made when they are first needed."""

import json
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from loader_peers.arrays import all_clips, digest
from loader_peers.entries import ENTRIES
from loader_peers.environments import interpreter
from loader_peers.processes import Child

_SAME_CLIPS = {"with_wsm": "limit"}
"""Contestants that read what another one writes: both read the release."""


class Contest:
    """Where a contestant is found by the name of its entry."""

    def __init__(self, cache: Path, processes: ExitStack):
        self._environments = cache / "environments"
        self._clips = cache / "clips"
        self._clips.mkdir(parents=True, exist_ok=True)
        self._processes = processes
        self._running: dict[str, Child] = {}
        self.digests = self._read_digests()

    @contextmanager
    def fresh(self, name: str) -> Iterator[Child]:
        """A process that has imported what the entry needs and done nothing else."""
        entry = ENTRIES[name]
        with Child(interpreter(self._environments, entry.environment), entry.module) as child:
            yield child

    def running(self, name: str) -> Child:
        """The process of the entry that goes on from one comparison to the next."""
        if name not in self._running:
            self._running[name] = self._processes.enter_context(self.fresh(name))
        return self._running[name]

    def setting(self, name: str, *, shuffle: bool, processes: bool) -> dict[str, object]:
        """What the entry's loader is opened with; our own keeps its threads where others have worker processes."""
        entry = ENTRIES[name]
        return {
            "folder": str(self._stored(name)),
            "shuffle": shuffle,
            "workers": entry.workers if processes else 0,
            "options": entry.options,
        }

    def _stored(self, name: str) -> Path:
        """The clips in the entry's format."""
        module = _SAME_CLIPS.get(ENTRIES[name].module, ENTRIES[name].module)
        folder = self._clips / module
        if not folder.exists():
            print(f"storing the clips for {name}", file=sys.stderr)
            with self.fresh(name) as child, tempfile.TemporaryDirectory(dir=self._clips) as scratch:
                child.ask("write", folder=f"{scratch}/{module}")
                (Path(scratch) / module).rename(folder)
        return folder

    def _read_digests(self) -> dict[str, str]:
        """Digest of each clip by its number, kept beside the clips."""
        path = self._clips / "digests.json"
        if not path.exists():
            path.write_text(json.dumps({number: digest(arrays) for number, arrays in enumerate(all_clips())}))
        return json.loads(path.read_text())
