"""How a release is published. Light: the command line takes its defaults."""

from dataclasses import dataclass

_LEAST_PART_MIB = 5  # of S3


@dataclass(frozen=True, kw_only=True)
class PublishConfig:
    """How a release is published.

    Attributes:
        threads: files that are uploaded at a time.
        part_mib: size of the parts in which S3 gets a file, MiB; each thread holds one. S3 takes 5 at least, and 10,000
            parts a file.
        replace: whether another release at the URL may be overwritten; it is unfinished until this one is whole.
    """

    threads: int = 4
    part_mib: int = 64
    replace: bool = False

    def __post_init__(self) -> None:
        if self.threads < 1:
            raise ValueError(f"threads must be at least 1, found {self.threads}")
        if self.part_mib < _LEAST_PART_MIB:
            raise ValueError(f"part_mib must be at least {_LEAST_PART_MIB}, found {self.part_mib}")
