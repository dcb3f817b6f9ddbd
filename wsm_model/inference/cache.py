"""Keys and values of clean tokens, kept from one planning step to the next.

They do not depend on the chunk size (see `wsm_model.mot.mask`), so they stay valid wherever the model replans. A
bounded cache drops its oldest frame, but never the anchor (paper silent on what is dropped).

Shape suffixes: B batch, F frames, P tokens of a frame, H heads, d width of a head.
"""

import torch
from torch import Tensor

_SLACK_FRAMES = 32


class FrameCache:
    """Keys and values of whole frames, in the order of time, per layer.

    Frames lie side by side in one buffer. To drop the oldest, the anchor is copied over it; the buffer is moved back to
    its beginning only when it has run through its slack, so a step costs the same whether frames are dropped or not.

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
        self._first = 0
        self._keys: list[Tensor | None] = [None] * layers
        self._values: list[Tensor | None] = [None] * layers

    def write(self, layer: int, frame: int, keys: Tensor, values: Tensor) -> None:
        """Store frames from number `frame` on, [B, F, P, H, d]; what was there is overwritten.

        Raises:
            ValueError: the frames would leave a gap, were dropped, or exceed the limit.
        """
        start = self._place(frame)
        end = start + keys.shape[1]
        if start > self.held or end > self.limit:
            raise ValueError(f"frames {frame} on must follow the {self.held} held of at most {self.limit}")
        for buffers, new in ((self._keys, keys), (self._values, values)):
            buffer = buffers[layer]
            if buffer is None:
                shape = (new.shape[0], self.limit + _SLACK_FRAMES, *new.shape[2:])
                buffer = buffers[layer] = new.new_empty(shape)
            buffer[:, self._first + start : self._first + end] = new
        if layer == len(self._keys) - 1:
            self.held = max(self.held, end)

    def read(self, layer: int, before: int) -> tuple[Tensor, Tensor] | None:
        """Keys and values of the held frames numbered below `before`, [B, F, P, H, d]; None where there are none."""
        keys, values = self._keys[layer], self._values[layer]
        count = self._place(before)
        if keys is None or values is None or count == 0:
            return None
        window = slice(self._first, self._first + count)
        return keys[:, window], values[:, window]

    def forget_from(self, frame: int) -> None:
        """Forget the frames numbered `frame` and above."""
        self.held = min(self.held, self._place(frame))

    def drop_oldest(self) -> None:
        """Drop the oldest frame but the anchor.

        Raises:
            ValueError: there is none but the anchor.
        """
        if self.held < 2:
            raise ValueError(f"there is no frame to drop beside the anchor, the cache holds {self.held}")
        for buffer in (*self._keys, *self._values):
            if buffer is not None:
                buffer[:, self._first + 1] = buffer[:, self._first]
        self._first += 1
        self.held -= 1
        self.dropped += 1
        if self._first == _SLACK_FRAMES:
            self._move_to_front()

    def _move_to_front(self) -> None:
        for buffer in (*self._keys, *self._values):
            if buffer is not None:
                buffer[:, : self.held] = buffer[:, self._first : self._first + self.held].clone()
        self._first = 0

    def _place(self, frame: int) -> int:
        """Position among the held frames."""
        if 1 <= frame <= self.dropped:
            raise ValueError(
                f"frame {frame} was dropped; the cache begins at frame {self.dropped + 1} after the anchor"
            )
        return frame - self.dropped if frame else 0


def joined(parts: list[tuple[Tensor, Tensor] | None]) -> tuple[Tensor, Tensor]:
    """Keys and values of several stretches of tokens, one after the other: [B, tokens, H, d]."""
    present = [part for part in parts if part is not None]
    rows = max(len(part[0]) for part in present)
    keys, values = (
        torch.cat([part[i].flatten(1, 2).expand(rows, -1, -1, -1) for part in present], dim=1) for i in range(2)
    )
    return keys, values
