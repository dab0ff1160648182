"""A first look at ratings by a fixed set of tests: statistics, figures, files and one HTML report."""
