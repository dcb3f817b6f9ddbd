"""Keys and values of clean tokens of one episode, kept from one planning step to the next.

They do not depend on the chunk size (see `wsm_model.mot.mask`), so they stay valid wherever the model replans. A
bounded cache drops its oldest frame, but never the anchor (paper silent on what is dropped).

Shape suffixes: F frames, P tokens of a frame, H heads, d width of a head.
"""

from typing import NamedTuple

from torch import Tensor


class KeysValues(NamedTuple):
    """Each [F, P, H, d], or [B, F, P, H, d] of several rows."""

    keys: Tensor
    values: Tensor


class FrameCache:
    """Keys and values of whole frames, in memory for exactly `limit` frames in each layer.

    The anchor has the first place; later frames take turns in the others, so the oldest gives way to the newest and
    nothing is moved. Attention does not ask for the order of its keys: positions are in the keys themselves.

    Args:
        layers: number of layers.
        limit: most frames that are held, anchor included.

    Attributes:
        held: frames that every layer holds.
        dropped: frames dropped so far: those numbered 1 to `dropped`.
    """

    def __init__(self, layers: int, limit: int):
        if limit < 2:
            raise ValueError(f"a cache must hold the anchor and at least one frame, found a limit of {limit}")
        self.limit = limit
        self.held = 0
        self.dropped = 0
        self._layers: list[KeysValues | None] = [None] * layers

    def write(self, layer: int, frame: int, new: KeysValues) -> None:
        """Store frames from number `frame` on; what was there is overwritten.

        Raises:
            ValueError: the frames would leave a gap, were dropped, or exceed the limit.
        """
        start = self._require_kept(frame)
        end = start + len(new.keys)
        if start > self.held or end > self.limit:
            raise ValueError(f"frames {frame} on must follow the {self.held} held of at most {self.limit}")
        buffers = self._layers[layer]
        if buffers is None:
            buffers = KeysValues(*(part.new_empty(self.limit, *part.shape[1:]) for part in new))
            self._layers[layer] = buffers
        for offset in range(len(new.keys)):
            for buffer, part in zip(buffers, new, strict=True):
                buffer[self._place(frame + offset)] = part[offset]
        if layer == len(self._layers) - 1:
            self.held = max(self.held, end)

    def read(self, layer: int, before: int) -> list[KeysValues]:
        """The held frames numbered below `before`, as views of the memory: stretches in the order of time."""
        buffers, count = self._layers[layer], self._require_kept(before)
        if buffers is None or count == 0:
            return []
        oldest = self._place(self.dropped + 1)
        end = oldest + count - 1
        stretches = (slice(0, 1), slice(oldest, min(end, self.limit)), slice(1, 1 + max(0, end - self.limit)))
        return [KeysValues(*(buffer[one] for buffer in buffers)) for one in stretches if one.start < one.stop]

    def drop_oldest(self) -> None:
        """Drop the oldest frame but the anchor.

        Raises:
            ValueError: there is none but the anchor.
        """
        if self.held < 2:
            raise ValueError(f"there is no frame to drop beside the anchor, the cache holds {self.held}")
        self.held -= 1
        self.dropped += 1

    def _place(self, frame: int) -> int:
        """Where a frame lies in the memory."""
        return 1 + (frame - 1) % (self.limit - 1) if frame else 0

    def _require_kept(self, frame: int) -> int:
        """How many of the frames that are kept come before this one."""
        if 1 <= frame <= self.dropped:
            raise ValueError(
                f"frame {frame} was dropped; the cache begins at frame {self.dropped + 1} after the anchor"
            )
        return frame - self.dropped if frame else 0
