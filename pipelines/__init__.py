"""Programs: the only place that wires the parts of WSM together."""
