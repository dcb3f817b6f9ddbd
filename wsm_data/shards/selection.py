"""Selections: which clips of a release were chosen, how hard each is and why, as a file beside the shards.

A selection names its release by digest. It changes no shard: a loader that is given one reads the clips it lists.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.arrow_arrays import arrow_numbers, arrow_texts, numpy_of
from wsm_data.files.digest import digest_json
from wsm_data.files.stores import Store, open_store
from wsm_data.files.tables import opened_table, read_full, read_statement, with_statement, write_table
from wsm_data.schema.arrays import Float64Array
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.names import SELECTIONS_FOLDER

SELECTION_SUFFIX = ".parquet"
SELECTION_VERSION = 1
_STATEMENT = "wsm.selection"
_SHOWN_CLIPS = 3
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
_SCHEMA = pa.schema([("key", pa.string()), ("rank", pa.int64()), ("score", pa.float64()), ("why", pa.string())])


@dataclass(frozen=True, kw_only=True, eq=False)
class Selection:
    """Clips of a release in the order of their difficulty.

    Attributes:
        name: name of the selection.
        release_digest: digest of the release (`wsm_data.shards.manifest.release_digest`).
        rule: every setting by which the clips were chosen; JSON values.
        command: the command that writes these bytes again.
        keys: key of each clip, hardest first; no key twice.
        scores: difficulty of each clip under the rule, finite, larger is harder; float64 [clips].
        why: which scores made each clip hard, as text.
    """

    name: str
    release_digest: str
    rule: Mapping[str, Any]
    command: str
    keys: pa.StringArray
    scores: Float64Array
    why: pa.StringArray

    def __post_init__(self) -> None:
        require_selection_name(self.name)
        if not len(self.keys) == len(self.scores) == len(self.why):
            raise ValueError(
                f"columns must be of one length, found {[len(self.keys), len(self.scores), len(self.why)]}"
            )
        if self.keys.null_count or pc.count_distinct(self.keys).as_py() != len(self.keys):
            raise ValueError("every clip must be listed once")
        if not np.isfinite(self.scores).all():
            raise ValueError("scores must be finite")

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def ranks(self) -> np.ndarray:
        """1 for the hardest clip, 2 for the next; int64 [clips]."""
        return np.arange(1, len(self) + 1, dtype=np.int64)

    def rows_of(self, index: IndexTable) -> np.ndarray:
        """Rows of the release's index that the selection lists, ascending; int64 [clips].

        Raises:
            IntegrityError: a clip is not in the index.
        """
        rows = index.rows_of(self.keys)
        missing = np.flatnonzero(rows < 0)
        if len(missing):
            raise IntegrityError(
                f"selection {self.name} lists {len(missing)} clips that its release does not have, such as "
                f"{self.keys[int(missing[0])].as_py()}; select again"
            )
        return np.sort(rows)


def require_selection_name(name: str) -> str:
    """The name, where it can be that of a selection.

    Raises:
        ValueError: it is not made of letters, digits, `_`, `-` and `.`, or ends like a file of a selection.
    """
    if not _NAME.fullmatch(name) or name.endswith(SELECTION_SUFFIX):
        raise ValueError(
            f"the name of a selection must be of letters, digits, _, - and ., such as hard, found {name!r}"
        )
    return name


def selection_path(name: str) -> str:
    """Where a selection stands in its release, relative to the release's folder."""
    return f"{SELECTIONS_FOLDER}/{name}{SELECTION_SUFFIX}"


def selection_names(release: Store) -> list[str]:
    """Names of the selections that stand in a release, sorted."""
    try:
        files = open_store(f"{release.root}/{SELECTIONS_FOLDER}").names()
    except FileNotFoundError:
        return []
    return [file.removesuffix(SELECTION_SUFFIX) for file in files if is_selection_file(file)]


def is_selection_file(text: str) -> bool:
    """Whether a text is a path of a selection file rather than the name of a selection."""
    return text.endswith(SELECTION_SUFFIX) and not Path(text).name.startswith(".")


def write_selection(path: Path, selection: Selection) -> None:
    """Write a selection atomically; equal selections and an equal pyarrow give equal bytes."""
    stated: dict[str, Any] = {
        "version": SELECTION_VERSION,
        "name": selection.name,
        "release_digest": selection.release_digest,
        "rule": dict(selection.rule),
        "command": selection.command,
        "clips": len(selection),
    }
    stated["sha256"] = digest_json(stated)  # parquet has checksums for its pages alone
    columns = [selection.keys, arrow_numbers(selection.ranks), arrow_numbers(selection.scores), selection.why]
    table = pa.Table.from_arrays(columns, schema=with_statement(_SCHEMA, _STATEMENT, stated))
    write_table(path, table, compression="zstd", use_dictionary=["why"])


def read_selection(
    release: Store | str | Path, name: str, release_digest: str, index: IndexTable | None = None
) -> Selection:
    """Read a selection of a release.

    Args:
        release: the release, or its folder or URL.
        name: name of a selection that stands in the release, or path or URL of a file that ends in `.parquet`.
        release_digest: digest of the release that is to be read.
        index: its index, where it is at hand: a refusal then says which clips it does not have.

    Raises:
        ConfigError: there is no such selection, or it was made from another release.
        IntegrityError: the file is damaged, or is no selection of this version.
    """
    store = open_store(release) if isinstance(release, str | Path) else release
    where, data = selection_file(store, name)
    selection = parse_selection(data, where)
    if selection.release_digest != release_digest:
        raise ConfigError(
            f"{where} was made from the release with digest {selection.release_digest}, but the release at "
            f"{store.root} has digest {release_digest}{_gone(selection, index)}; read it with that release, or select "
            f"again: {selection.command}"
        )
    return selection


def _gone(selection: Selection, index: IndexTable | None) -> str:
    """What a message says of the clips of a selection that an index does not have."""
    if index is None:
        return ""
    gone = np.flatnonzero(index.rows_of(selection.keys) < 0)
    if not len(gone):
        return f", and all {len(selection)} clips are still there"
    shown = ", ".join(selection.keys[int(number)].as_py() for number in gone[:_SHOWN_CLIPS])
    return f", and {len(gone)} of its {len(selection)} clips are gone, such as {shown}"


def parse_selection(data: bytes, where: str) -> Selection:
    """Read a selection of any release from the bytes of its file.

    Args:
        data: content of the file.
        where: its place, for messages.

    Raises:
        IntegrityError: the file is damaged, or is no selection of this version.
    """
    must_be, remedy = f"{where} must be a selection", "restore it or select again"
    with opened_table(partial(pa.BufferReader, data), must_be, remedy) as file:
        stated = read_statement(file.schema_arrow, _STATEMENT, SELECTION_VERSION)
        return _parse(read_full(file, _SCHEMA), stated)


def _parse(table: pa.Table, stated: Mapping[str, Any]) -> Selection:
    if digest_json({key: value for key, value in stated.items() if key != "sha256"}) != stated["sha256"]:
        raise ValueError("its metadata was changed since it was written")
    if table.num_rows != stated["clips"]:
        raise ValueError(f"it must have {stated['clips']} rows, found {table.num_rows}")
    selection = Selection(
        name=stated["name"],
        release_digest=stated["release_digest"],
        rule=stated["rule"],
        command=stated["command"],
        keys=_whole(table["key"]),
        scores=numpy_of(table["score"]),
        why=_whole(table["why"]),
    )
    if not np.array_equal(numpy_of(table["rank"]), selection.ranks):
        raise ValueError("ranks must count from 1")
    return selection


def _whole(column: pa.ChunkedArray) -> pa.StringArray:
    return pa.concat_arrays(column.chunks) if column.num_chunks else arrow_texts([])


def selection_file(release: Store, name: str) -> tuple[str, bytes]:
    """Place and content of the file of a selection.

    Args:
        release: the release.
        name: name of a selection that stands in the release, or path or URL of a file that ends in `.parquet`.

    Raises:
        ConfigError: there is no such selection.
    """
    if is_selection_file(name):
        folder, slash, file = name.rpartition("/")
        store, listed = open_store(folder + slash if slash else "."), ""
    else:
        store, file = release, selection_path(name)
        listed = f"; it has {', '.join(selection_names(release)) or 'none'}"
    where = f"{store.root.rstrip('/')}/{file}"
    try:
        return where, store.read(file)
    except FileNotFoundError as error:
        raise ConfigError(f"there is no selection at {where}{listed}; make one with `wsm select`") from error
