"""The evaluation of texture models: every method on every texture, its tables, figures and report."""
