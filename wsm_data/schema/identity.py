"""What a trajectory is called, everywhere and in every layout."""

import re
from dataclasses import dataclass

_UNSAFE = re.compile(r"[^A-Za-z0-9_-]")


@dataclass(frozen=True, order=True)
class EpisodeId:
    """One trajectory of a source: stable text from the data, the same in each of the layouts it can be stored in.

    Attributes:
        group: dataset group, such as `gibson_d435i`; its last `_`-separated word is the camera.
        scene: scene name within the group.
        episode: episode number as six digits, or the name of the trajectory folder where it has no number.
    """

    group: str
    scene: str
    episode: str

    def __post_init__(self) -> None:
        for field, value in (("group", self.group), ("scene", self.scene), ("episode", self.episode)):
            if value in ("", ".", "..") or "/" in value:
                raise ValueError(f"{field} of an episode id must be a name, not a path, found {value!r}")

    @property
    def text(self) -> str:
        """`group/scene/episode`, the unit id of the stages."""
        return f"{self.group}/{self.scene}/{self.episode}"

    @property
    def key(self) -> str:
        """Key of the clip in a shard: the text with everything but letters, digits, `_`, `-` percent-encoded.

        webdataset ends a key at the first dot of the base name, so a dot in a scene name must not stand in a key.
        """
        return "/".join(_quote(part) for part in (self.group, self.scene, self.episode))

    @property
    def camera(self) -> str:
        """Name of the camera, the last word of the group: `d435i` or `zed` in InternData-N1."""
        return self.group.rpartition("_")[2]

    @property
    def physical_scene(self) -> str:
        """The scene without its camera: `gibson/Ackermanville` for both `gibson_d435i` and `gibson_zed`."""
        return f"{self.group.rpartition('_')[0] or self.group}/{self.scene}"

    @classmethod
    def parse(cls, text: str) -> "EpisodeId":
        """Inverse of `text`.

        Raises:
            ValueError: the text has not three parts.
        """
        parts = text.split("/")
        if len(parts) != 3:
            raise ValueError(f"an episode id has the form group/scene/episode, found {text!r}")
        return cls(*parts)


def _quote(part: str) -> str:
    # surrogatepass: a file name that is not valid UTF-8 has a key as well, and one of its own
    return _UNSAFE.sub(lambda match: "".join(f"%{byte:02X}" for byte in match[0].encode(errors="surrogatepass")), part)
