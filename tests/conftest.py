"""Settings shared by all tests."""

from hypothesis import settings

# Examples are derived from the test, not from chance: a red test stays red until it is mended.
settings.register_profile("quick", deadline=None, max_examples=60, derandomize=True)
settings.register_profile("soak", deadline=None, max_examples=3000)
settings.load_profile("quick")
