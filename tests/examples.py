"""How many examples hypothesis tries: those that a test names in the full run, a quarter of them in the bare run."""

from hypothesis import settings

FEWEST = 5


def examples(count: int) -> int:
    """Return how many of `count` examples this run tries; the profile is loaded in conftest.py."""
    return min(count, max(FEWEST, count * settings.default.max_examples // 100))
