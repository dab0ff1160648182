"""The statistics that a plan may ask for, a family in two files: what it may say, and its answers.

A new statistic is a function in `analysis/statistics/` or the folder of its topic, with a `Kind` in `KINDS` of a family
here and what turns the function's result into rows.
"""
