"""Library half of WSM: from raw navigation trajectories to shards, and back."""
