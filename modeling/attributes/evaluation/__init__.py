"""The evaluation of predicted attributes: every method without each texture once, its tables, figures and report."""
