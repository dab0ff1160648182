"""Tests of the ANOVA family: mixed designs, sphericity, intervals, families, equivalence, exact checks, plans."""
