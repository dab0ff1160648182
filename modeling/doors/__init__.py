"""Car doors: from a force profile to ratings, and from wished ratings to a force profile (thesis chapter 5)."""
