"""One clip in words and numbers, for a terminal."""

import numpy as np

from wsm_data.files.json_values import to_json
from wsm_data.schema.clip import MEMBERS, UNREACHABLE_MM, Clip
from wsm_data.view.clip.facts import ClipFacts, clip_facts
from wsm_data.view.drawing.text_table import aligned, bytes_text, printable

_UNITS = {
    "rgb_latent": "codec units",
    "depth_latent": "codec units",
    "depth_valid": "share x 255",
    "poses": "m, quaternion wxyz",
    "occupancy": "0 free, 1 occupied, 255 unknown",
    "geodesic_mm": "mm, where reachable",
    "expert_distance": "m",
}


def describe_clip(clip: Clip) -> str:
    """Members with their statistics, the facts of the path and map, and the provenance of a clip, as aligned text."""
    return printable("\n\n".join([clip.meta.key, _members(clip), _facts(clip_facts(clip)), _provenance(clip)]))


def _members(clip: Clip) -> str:
    rows = [("member", "dtype", "axes", "shape", "size", "min", "mean", "max", "std", "unit")]
    for name, array in clip.arrays().items():
        numbers = array[array != UNREACHABLE_MM] if name == "geodesic_mm" else array
        shape = " x ".join(str(length) for length in array.shape)
        statistics = _statistics(numbers)
        rows.append(
            (name, str(array.dtype), MEMBERS[name][1], shape, bytes_text(array.nbytes), *statistics, _UNITS[name])
        )
    return aligned(rows, right=(4, 5, 6, 7, 8))


def _statistics(numbers: np.ndarray) -> tuple[str, str, str, str]:
    if not numbers.size:
        return "-", "-", "-", "-"
    wide = numbers.astype(np.float64)
    low, mean, high, std = wide.min(), wide.mean(), wide.max(), wide.std()
    return f"{low:.5g}", f"{mean:.5g}", f"{high:.5g}", f"{std:.5g}"


def _facts(facts: ClipFacts) -> str:
    rows = [
        ("fact", "value"),
        ("frames", f"{facts.frames}, then {facts.padded_frames} still ones"),
        ("path length", f"{facts.path_length_m:.3f} m"),
        ("geodesic distance at the start", f"{facts.start_distance_m:.3f} m"),
        ("detour, geodesic / straight", _number(facts.detour, "")),
        ("clearance, median", _number(facts.clearance_median_m, " m")),
        ("clearance, least", _number(facts.clearance_min_m, " m")),
        ("camera", f"{facts.camera_height_m:.3f} m high, pitched down {facts.camera_pitch_deg:.2f} degrees"),
        ("depth measured", _share(facts.depth_valid_share)),
        ("map", f"{facts.map_area_m2:.1f} m2, {facts.map_unknown_share:.1%} unknown"),
        ("notes", ", ".join(facts.notes) or "none"),
    ]
    return aligned(rows)


def _share(value: float | None) -> str:
    return "the clip has no depth" if value is None else f"{value:.2%} of pixels"


def _number(value: float | None, unit: str) -> str:
    return "not defined for this clip" if value is None else f"{value:.3f}{unit}"


def _provenance(clip: Clip) -> str:
    rows = [("provenance", "value")]
    for name, value in to_json(clip.meta).items():
        if name == "T_world_camera0":
            rows += [(f"{name} [{row}]", "  ".join(f"{one: .6f}" for one in line)) for row, line in enumerate(value)]
        elif isinstance(value, dict):
            rows += [(f"{name}.{part}", str(one)) for part, one in value.items()]
        elif isinstance(value, list):
            rows.append((name, ", ".join(str(one) for one in value) or "none"))
        else:
            rows.append((name, str(value)))
    return aligned(rows)
