"""The kinds of test that a plan may ask for: each file's settings, and how the statistics answer them."""
