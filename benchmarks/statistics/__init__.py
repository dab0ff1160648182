"""Statistics, against exact answers, R, pingouin and statsmodels."""
