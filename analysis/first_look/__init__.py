"""A first look at ratings by one fixed set of tests: statistics, figures, files and one HTML report."""
