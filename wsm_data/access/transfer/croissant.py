"""A published release as Croissant 1.0 (JSON-LD of MLCommons) describes it: its files, and the rows of its index."""

import json
from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from wsm_data.access.release import Release
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.names import INDEX_NAME

CROISSANT_NAME = "croissant.json"
_RECORDS = "clips"
_CROISSANT_WORDS = (
    *("citeAs", "column", "extract", "field", "fileProperty", "fileObject", "fileSet", "format", "includes"),
    *("isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "recordSet", "references", "regex", "repeated"),
    *("replace", "separator", "source", "subField", "transform"),
)
_CONTEXT: Mapping[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "cr": "http://mlcommons.org/croissant/",
    "dct": "http://purl.org/dc/terms/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "sc": "https://schema.org/",
    "conformsTo": "dct:conformsTo",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    **{word: f"cr:{word}" for word in _CROISSANT_WORDS},
}


def croissant(release: Release) -> str:
    """Text of croissant.json: the same for equal releases, since a release has no date.

    Arrays of clips are members of tars, for which Croissant has no type: the shards are named with their checksums, and
    the records are the rows of the index, one a clip, with the place of each member.
    """
    manifest = release.manifest
    licences = sorted(set(manifest.licences.values()))
    files = [_file(INDEX_NAME, "application/x-parquet", manifest.index_sha256, None)]
    files += [_file(shard.name, "application/x-tar", shard.sha256, shard.bytes) for shard in manifest.shards]
    record = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": manifest.name,
        "description": (
            f"{manifest.clips:,} clips of {manifest.frames:,} frames for the World SLAM Model: latents of colour and "
            f"depth of the codec {manifest.codec.name}, relative poses, occupancy maps and geodesic distances, in "
            "webdataset shards"
        ),
        **({"license": licences} if licences else {}),
        "identifier": release.digest,
        "distribution": files,
        "recordSet": [{"@type": "cr:RecordSet", "@id": _RECORDS, "name": _RECORDS, "field": _fields()}],
    }
    return json.dumps(record, indent=1) + "\n"


def _file(name: str, kind: str, sha256: str, size_bytes: int | None) -> dict[str, Any]:
    size = {} if size_bytes is None else {"contentSize": f"{size_bytes} B"}
    about = {"@type": "cr:FileObject", "@id": name, "name": name, "contentUrl": name, "encodingFormat": kind}
    return {**about, **size, "sha256": sha256}


def _fields() -> list[dict[str, Any]]:
    """The columns of the index."""
    return [
        {
            "@type": "cr:Field",
            "@id": f"{_RECORDS}/{column.name}",
            "name": column.name,
            "dataType": "sc:Integer" if pa.types.is_integer(column.type) else "sc:Text",
            "source": {"fileObject": {"@id": INDEX_NAME}, "extract": {"column": column.name}},
        }
        for column in SCHEMA
    ]
