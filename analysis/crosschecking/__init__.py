"""A second opinion: tables of `regenerate` held against pingouin and statsmodels."""
