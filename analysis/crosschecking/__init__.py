"""A second opinion: tables of `regenerate` compared with pingouin and statsmodels."""
