"""Which rank this process is."""

import torch.distributed


def place_among_ranks(rank: int | None, world_size: int | None) -> tuple[int, int]:
    """Rank and number of ranks, as given, or as torch.distributed has them; rank 0 of 1 where it is not initialised.

    Raises:
        ValueError: one of them was given without the other, or there is no such rank.
    """
    if (rank is None) != (world_size is None):
        raise ValueError(f"rank and world_size belong together, found rank = {rank}, world_size = {world_size}")
    if rank is None or world_size is None:
        together = torch.distributed.is_available() and torch.distributed.is_initialized()
        rank = torch.distributed.get_rank() if together else 0
        world_size = torch.distributed.get_world_size() if together else 1
    if not 0 <= rank < world_size:
        raise ValueError(f"rank must lie in [0, world_size = {world_size}), found {rank}")
    return rank, world_size
