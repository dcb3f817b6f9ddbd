"""The card of a published release: what it is, and the columns that Hugging Face's `datasets` loads its shards with."""

import json
from dataclasses import fields, is_dataclass
from typing import Any, get_args, get_type_hints

from wsm_data.access.release import Release
from wsm_data.schema.clip import MEMBERS, META_MEMBER
from wsm_data.schema.clip_meta import ClipMeta

CARD_NAME = "README.md"
_VALUES = {str: "string", int: "int64", float: "float64"}


def dataset_card(release: Release) -> str:
    """Text of README.md as the Hugging Face Hub reads it: a head in YAML, and below it facts of the manifest.

    The head names every column with its type. Without it `datasets` guesses types from the first five clips, and takes
    lists that are empty there, such as `notes`, for lists of nothing.
    """
    manifest = release.manifest
    files = [{"split": split, "path": f"{split}-*.tar"} for split in sorted(manifest.clips_by_split)]
    head = {
        "pretty_name": manifest.name,
        "configs": [{"config_name": "default", "data_files": files}],
        "dataset_info": {"features": shard_features()},
    }
    lines = [f"{name}: {json.dumps(value)}" for name, value in head.items()]
    splits = ", ".join(f"{count:,} {split}" for split, count in sorted(manifest.clips_by_split.items()))
    facts = [
        f"- {manifest.clips:,} clips ({splits}), {manifest.frames:,} frames, {manifest.latents:,} latents",
        f"- codec {manifest.codec.name}, digest `{manifest.codec.digest}`",
        f"- images of {manifest.encoded_width_px} x {manifest.encoded_height_px} px",
        f"- digest of the release: `{release.digest}`",
        *(f"- licence of {name}: {text}" for name, text in sorted(manifest.licences.items())),
    ]
    return "\n".join(["---", *lines, "---", "", f"# {manifest.name}", "", *facts, ""])


def shard_features() -> list[dict[str, Any]]:
    """Columns of a shard as `dataset_info` lists them: arrays as nested lists, and the fields of meta.json."""
    columns: list[dict[str, Any]] = []
    for name, (dtype, axes) in MEMBERS.items():
        column: Any = dtype.name
        for _ in axes:
            column = {"list": column}
        columns.append({"name": f"{name}.npy", **column})
    columns.append({"name": META_MEMBER, "struct": _struct(ClipMeta)})
    return [*columns, {"name": "__key__", "dtype": "string"}, {"name": "__url__", "dtype": "string"}]


def _struct(kind: type[Any]) -> list[dict[str, Any]]:
    """Fields of a dataclass in the order of their names, in which JSON has them."""
    hints = get_type_hints(kind)
    return [{"name": name, **_column(hints[name])} for name in sorted(one.name for one in fields(kind))]


def _column(kind: Any) -> dict[str, Any]:
    if is_dataclass(kind) and isinstance(kind, type):
        return {"struct": _struct(kind)}
    if kind in _VALUES:
        return {"dtype": _VALUES[kind]}
    inner = _column(get_args(kind)[0])
    return {"list": inner["dtype"] if set(inner) == {"dtype"} else inner}
