"""Linear mixed models: fixed effects, and random effects of any number of nested or crossed grouping factors."""
