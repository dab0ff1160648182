"""The evaluation of predicted attributes by leaving each texture out once, with tables, figures and a report."""
