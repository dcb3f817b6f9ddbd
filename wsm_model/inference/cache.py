"""Keys and values of what one episode has shown, kept from one planning step to the next.

Those of clean tokens do not depend on the chunk size (see `wsm_model.mot.mask`), so they stay valid wherever the model
replans. A bounded cache drops its oldest frame, but never the anchor (paper silent on what is dropped).

In each layer RGB frames lie below the middle of one memory, each later one lower, and states above it, each later one
higher. What a pass brings itself is written at the ends:

    own RGB | RGB frames | states | own states

So whatever a pass may see is one stretch of memory: attention reads a view, and no history is copied.

Shape suffixes: F frames, P tokens of a frame, H heads, d width of a head, L tokens.
"""

from enum import IntEnum
from typing import NamedTuple

from torch import Tensor

from wsm_model.config import Expert, ModelConfig


class KeysValues(NamedTuple):
    """Each [F, P, H, d], or [B, F, P, H, d] of several rows."""

    keys: Tensor
    values: Tensor


class Side(IntEnum):
    """What a frame of tokens stands for: RGB, or depth and pose."""

    RGB = 0
    STATE = 1


class Places:
    """Which frames are kept, by their place in the memory.

    Attention does not ask for the order of its keys, since positions are in the keys themselves: the place of a frame
    that is dropped is filled with the frame of the last place.

    Args:
        limit: most frames that are kept, the anchor among them.

    Attributes:
        numbers: of the frame at each place.
        next: number of the frame that comes next.
    """

    def __init__(self, limit: int):
        if limit < 2:
            raise ValueError(f"a cache must hold the anchor and at least one frame, found a limit of {limit}")
        self.limit = limit
        self.numbers: list[int] = []
        self.next = 0

    @property
    def held(self) -> int:
        """Frames that are kept."""
        return len(self.numbers)

    def keep(self, frames: int) -> None:
        """Keep the next `frames` frames, which were written behind the last place.

        Raises:
            ValueError: they exceed the limit.
        """
        if self.held + frames > self.limit:
            raise ValueError(f"{frames} frames cannot be kept beside {self.held} of at most {self.limit}")
        self.numbers += range(self.next, self.next + frames)
        self.next += frames

    def forget_from(self, frame: int) -> None:
        """Forget a frame and all after it, which must stand at the last places: the next frame is this one.

        Raises:
            ValueError: it is not among those that were kept since one was dropped.
        """
        end = self.held - (self.next - frame)
        if not 0 <= end <= self.held or self.numbers[end:] != list(range(frame, self.next)):
            raise ValueError(f"frame {frame} on must stand at the end of what is kept, found {self.numbers}")
        del self.numbers[end:]
        self.next = frame

    def drop_oldest(self) -> tuple[int, int]:
        """Drop the oldest frame but the anchor; the frame at the last place must be moved to where it was.

        Returns:
            The last place, and where its frame belongs now.

        Raises:
            ValueError: there is none but the anchor.
        """
        if self.held < 2:
            raise ValueError(f"there is no frame to drop beside the anchor, the cache holds {self.held}")
        hole = min(range(1, self.held), key=self.numbers.__getitem__)
        self.numbers[hole] = self.numbers[-1]
        self.numbers.pop()
        return self.held, hole


class History:
    """Clean RGB and clean state tokens of one episode, in memory for exactly `limit` frames and one pass of `spare`.

    Args:
        config: the model.
        limit: most frames that are kept of either side, the anchor among them.
        spare: most frames that a pass brings itself.

    Attributes:
        rgb: which frames of clean RGB are kept.
        state: which frames of clean states are kept.
    """

    def __init__(self, config: ModelConfig, limit: int, spare: int):
        self.rgb, self.state = Places(limit), Places(limit)
        self.spare = spare
        self._tokens = (config.tokens[Expert.GENERATION], sum(config.tokens[expert] for expert in config.state_experts))
        self._layers: list[KeysValues | None] = [None] * config.layers

    def write(self, layer: int, side: Side, own: KeysValues) -> None:
        """Write frames [F, P, H, d] behind those that are kept; they are kept if `Places.keep` is told so.

        Raises:
            ValueError: there is no room for so many.
        """
        held, frames = self._side(side).held, len(own.keys)
        if frames > self.spare:
            raise ValueError(f"a pass may bring at most {self.spare} frames, found {frames}")
        first, last = (self._place(side, place) for place in (held, held + frames - 1))
        place = slice(min(first.start, last.start), max(first.stop, last.stop))
        for memory, part in zip(self._memory(layer, own), own, strict=True):
            memory[:, place] = by_head(part.flip(0) if side is Side.RGB else part)

    def read(self, layer: int, rgb: int, states: int) -> KeysValues:
        """The frames of the first `rgb` places and of the first `states` places: views, [H, L, d] each.

        Raises:
            ValueError: nothing was written yet.
        """
        memory, stretch = self._layers[layer], self._stretch(rgb, states)
        if memory is None:
            raise ValueError("a history must be written to before it is read")
        return KeysValues(memory.keys[:, stretch], memory.values[:, stretch])

    def make_room(self, frames: int) -> None:
        """Drop the oldest frames of both sides until `frames` more of RGB can be kept."""
        while self.rgb.held + frames > self.rgb.limit:
            for side in Side:
                last, hole = self._side(side).drop_oldest()
                self._move(side, last, hole)

    def held(self, side: Side) -> int:
        """Frames that are kept of a side."""
        return self._side(side).held

    def _side(self, side: Side) -> Places:
        return self.rgb if side is Side.RGB else self.state

    def _move(self, side: Side, last: int, hole: int) -> None:
        source, target = (self._place(side, place) for place in (last, hole))
        for memory in self._layers:
            for part in memory or ():
                part[:, target] = part[:, source]

    def _place(self, side: Side, place: int) -> slice:
        """Tokens of one place."""
        start = self._stretch(place + 1, 0).start if side is Side.RGB else self._stretch(0, place).stop
        return slice(start, start + self._tokens[side])

    def _stretch(self, rgb: int, states: int) -> slice:
        """Tokens of the first places of either side."""
        middle = (self.rgb.limit + self.spare) * self._tokens[Side.RGB]
        return slice(middle - rgb * self._tokens[Side.RGB], middle + states * self._tokens[Side.STATE])

    def _memory(self, layer: int, like: KeysValues) -> KeysValues:
        """Keys and values of a layer, [H, L, d] each; taken when it is first written to."""
        memory = self._layers[layer]
        if memory is None:
            heads, width = like.keys.shape[-2:]
            length = (self.rgb.limit + self.spare) * sum(self._tokens)
            memory = KeysValues(*(part.new_empty(heads, length, width) for part in like))
            self._layers[layer] = memory
        return memory


def by_head(frames_FPHd: Tensor) -> Tensor:
    """Tokens of frames one after the other in each head, [H, L, d]."""
    return frames_FPHd.flatten(0, 1).transpose(0, 1)
