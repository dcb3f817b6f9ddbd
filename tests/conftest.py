"""Settings of every property test: the same examples on every machine, and no time limits that a busy machine breaks."""

from hypothesis import settings

settings.register_profile("wsm", deadline=None, derandomize=True)
settings.load_profile("wsm")
