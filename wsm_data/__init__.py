"""Library half of WSM: from raw navigation trajectories to shards, and back."""

from pathlib import Path

from wsm_data.files.kernel_cache import settle_kernel_cache

settle_kernel_cache(Path(__file__).parent)
