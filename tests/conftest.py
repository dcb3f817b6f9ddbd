"""Settings of every property test: the same examples everywhere, and no time limits for a busy machine to break."""

from hypothesis import settings

settings.register_profile("wsm", deadline=None, derandomize=True)
settings.load_profile("wsm")
