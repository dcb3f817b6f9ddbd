from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from pipelines.running.described_settings import Setting, attribute_meanings, describe_settings


class Side(Enum):
    LEFT = "left"
    RIGHT = "right"


@dataclass(frozen=True, kw_only=True)
class Lens:
    """A lens.

    Attributes:
        near_m, far_m: what is sharp,
            m.
    """

    near_m: float = 0.5
    far_m: float | None = None


@dataclass(frozen=True, kw_only=True)
class Body:
    """What a camera stands on.

    Attributes:
        feet: how many.
    """

    feet: int = 3


@dataclass(frozen=True, kw_only=True)
class Camera(Body):
    """A camera.

    Attributes:
        out: where it writes.
        side: of the robot.
        lens: the lens
            in front: wide.
        spare: more lenses.
        named: lenses by name.
        sizes: width and height, px.

    Raises:
        nothing: at all.
    """

    out: Path
    side: Side = Side.LEFT
    lens: Lens = field(default_factory=lambda: Lens(near_m=2.0))
    spare: tuple[Lens, ...] = ()
    named: Mapping[str, Lens] = field(default_factory=dict)
    sizes: tuple[int, int] = (4, 3)


def test_every_field_is_described_by_its_type_its_default_and_its_docstring():
    lens = ("what is sharp, m.",) * 2
    expected = [
        ("feet", "whole number", "3", "how many."),
        ("out", "path", "required", "where it writes."),
        ("side", '"left" or "right"', '"left"', "of the robot."),
        ("lens", "section", "", "the lens in front: wide."),
        ("lens.near_m", "number", "2.0", lens[0]),  # the camera's own default of the section, not that of a lens
        ("lens.far_m", "number, or none", "none", lens[1]),
        ("spare", "list: section each", "[]", "more lenses."),
        ("spare[].near_m", "number", "0.5", lens[0]),
        ("spare[].far_m", "number, or none", "none", lens[1]),
        ("named", "section by name", "{}", "lenses by name."),
        ("named.NAME.near_m", "number", "0.5", lens[0]),
        ("named.NAME.far_m", "number, or none", "none", lens[1]),
        ("sizes", "list of 2: whole number each", "[4, 3]", "width and height, px."),
    ]
    found = list(describe_settings(Camera))
    assert found == [Setting(name=a, type=b, default=c, meaning=d) for a, b, c, d in expected]


def test_meanings_end_with_their_section_of_the_docstring():
    assert "nothing" not in attribute_meanings(Camera)


def test_what_the_docstring_leaves_out_has_no_meaning():
    @dataclass(frozen=True, kw_only=True)
    class Silent:
        """Says nothing."""

        depth: int = 1

    assert next(describe_settings(Silent)).meaning == ""
