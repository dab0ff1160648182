"""A cross-check: results of `regenerate` compared with pingouin and statsmodels."""
