"""The evaluation of door models: every method on the same folds, its tables, figures and report."""
