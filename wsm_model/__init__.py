"""The World SLAM Model: built on the releases that `wsm_data` writes."""
