import json

import pyarrow as pa
import pytest

from wsm_data.files.sealed import sealed
from wsm_data.shards.scores_statement import read_scores_statement, with_scores_statement

COLUMNS = pa.schema([("key", pa.string())])


def test_a_statement_is_read_back():
    stated = read_scores_statement(with_scores_statement(COLUMNS, "d" * 64, [{"name": "detour_ratio"}]))
    assert (stated["release_digest"], stated["scorers"]) == ("d" * 64, [{"name": "detour_ratio"}])


def test_another_digest_under_the_old_checksum_is_noticed():
    schema = with_scores_statement(COLUMNS, "d" * 64, [])
    changed = schema.metadata[b"wsm.scores"].replace(b"dd", b"ee", 1)
    with pytest.raises(ValueError, match="was changed since it was written"):
        read_scores_statement(schema.with_metadata({b"wsm.scores": changed}))


def test_other_versions_and_tables_without_a_statement_are_refused():
    older = json.dumps(sealed({"version": 2, "release_digest": "d" * 64, "scorers": []}))
    for schema, found in ((COLUMNS, "None"), (COLUMNS.with_metadata({"wsm.scores": older}), "2")):
        with pytest.raises(ValueError, match=f"must say version 3, found {found}"):
            read_scores_statement(schema)
