"""Car doors: from a force profile to a feeling, and from a wished-for feeling to a force profile (thesis chapter 5)."""
