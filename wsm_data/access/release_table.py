"""One table of all clips: the index, and the scores that stand beside it."""

from functools import partial

import pyarrow as pa

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.stores import Store
from wsm_data.files.tables import opened_table
from wsm_data.shards.index.row import REPEATED_COLUMNS, SCHEMA
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.scores_statement import read_scores_statement

_REMEDY = "run `wsm score` again"


def release_table(store: Store, index: IndexTable, digest: str) -> pa.Table:
    """All columns of the index, with plain texts, and behind them the scores where the release has any.

    Args:
        store: where the release is.
        index: its index.
        digest: its digest, which scores must name.

    Raises:
        ConfigError: the scores are of another release.
        IntegrityError: a table is damaged, or the scores are of other clips.
    """
    table = index.columns(SCHEMA.names).replace_schema_metadata()
    for name in REPEATED_COLUMNS:
        table = table.set_column(table.schema.get_field_index(name), name, table[name].cast(pa.string()))
    if not store.exists(SCORES_NAME):
        return table
    where = f"{store.root}/{SCORES_NAME}"
    with opened_table(
        partial(pa.BufferReader, store.read(SCORES_NAME)), f"{where} must be a table of scores", _REMEDY
    ) as file:
        found = read_scores_statement(file.schema_arrow)["release_digest"]
        scores = file.read()
    if found != digest:
        raise ConfigError(f"{where} must hold the scores of this release, {digest}, found those of {found}; {_REMEDY}")
    if not scores["key"].combine_chunks().equals(table["key"].combine_chunks()):
        raise IntegrityError(f"{where} must have a row for each clip, in the order of the index; {_REMEDY}")
    for field in scores.schema:
        if pa.types.is_floating(field.type) and field.name not in table.column_names:
            table = table.append_column(field.name, scores[field.name])
    return table
