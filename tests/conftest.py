"""Settings of the whole suite."""

from hypothesis import settings

# Shared machines stall at random: speed is the benchmarks' business. The same examples every time.
settings.register_profile("seip", deadline=None, derandomize=True)
settings.load_profile("seip")
