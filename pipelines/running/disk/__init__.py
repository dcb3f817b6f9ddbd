"""What the disk does to a running stage, as sentences: it is full, or a folder is gone."""
