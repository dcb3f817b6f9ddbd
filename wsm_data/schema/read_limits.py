"""How much a file of a source may hold before it is taken for damage, or for an attack."""

from dataclasses import dataclass, fields


@dataclass(frozen=True, kw_only=True)
class ReadLimits:
    """What is refused unread, or undecoded: each limit is compared with what a file declares, before memory is taken.

    Attributes:
        max_frames: images of one trajectory, and rows of its table.
        max_file_bytes: of any file that is read, after decompression. The largest of a scene is its cloud: 1 GiB is
            70 million points.
        max_json_bytes: of a file of JSON lines; parsed, they need ten times as much.
        max_image_pixels: of an image, width times height.
    """

    max_frames: int = 100_000
    max_file_bytes: int = 1 << 30
    max_json_bytes: int = 1 << 24
    max_image_pixels: int = 1 << 24

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value < 1:
                raise ValueError(f"{field.name} must be at least 1, found {value}")
