"""Which numbers of a clip are shown as distributions, and under which labels."""

from collections.abc import Sequence
from dataclasses import dataclass

from wsm_data.view.clip.facts import ClipFacts


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """One number per clip.

    Attributes:
        title: what it is, in a few words.
        label: the same for an axis, with its unit.
        finest: narrowest bin that tells something, in the unit of the label.
        values: the number of every clip that has it.
        missing: clips that do not have it.
        share: whether the numbers are shares.
    """

    title: str
    label: str
    finest: float
    values: tuple[float, ...]
    missing: int = 0
    share: bool = False


_SHOWN = (
    ("path_length_m", "Path length", "length of the expert's path (m)", 0.1, False),
    ("start_distance_m", "Distance at the start", "geodesic distance to the goal region (m)", 0.1, False),
    ("detour", "Detour", "geodesic / straight distance (ratio)", 0.01, False),
    ("clearance_median_m", "Clearance, median", "distance to the nearest obstacle (m)", 0.01, False),
    ("clearance_min_m", "Clearance, least", "distance to the nearest obstacle (m)", 0.01, False),
    ("camera_height_m", "Camera height", "height above the floor (m)", 0.01, False),
    ("camera_pitch_deg", "Camera pitch", "pitch down (degrees)", 0.5, False),
    ("depth_valid_share", "Depth measured", "share of depth pixels (%)", 0.005, True),
    ("map_area_m2", "Map size", "area of the map crop (m²)", 1.0, False),
    ("map_unknown_share", "Unknown map", "share of the crop's cells (%)", 0.005, True),
)


def clip_distributions(facts: Sequence[ClipFacts]) -> tuple[Distribution, ...]:
    """The distributions over some clips, in the order in which they are shown."""
    return tuple(_distribution(facts, *shown) for shown in _SHOWN)


def _distribution(
    facts: Sequence[ClipFacts], name: str, title: str, label: str, finest: float, share: bool
) -> Distribution:
    values = tuple(value for one in facts if (value := getattr(one, name)) is not None)
    missing = len(facts) - len(values)
    return Distribution(title=title, label=label, finest=finest, values=values, missing=missing, share=share)
