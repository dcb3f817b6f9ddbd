"""A file of a container, whatever the container is stored as."""

from dataclasses import dataclass

from wsm_data.errors import DataError


@dataclass(frozen=True, slots=True)
class Member:
    """A file of a container.

    Attributes:
        name: its path, with `/`.
        size: bytes of its content.
        data: the content. From an archive it is a view into a reused buffer, valid until the next member is asked for:
            whoever keeps it takes `bytes(member.data)`.
        refusal: why the system did not give the content, if so; the data is then empty.
    """

    name: str
    size: int
    data: memoryview
    refusal: DataError | None = None

    def content(self) -> memoryview:
        """The data.

        Raises:
            DataError: `file.unreadable`.
        """
        if self.refusal is not None:
            raise self.refusal
        return self.data
