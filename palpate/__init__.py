"""Palpate: psychophysics experiments on touch. Nothing lost, every number regenerated.

The folders `protocols`, `signals`, `devices`, `studies`, `analysis` and `modeling` at the top of the repository are
this package's subpackages: `from palpate.analysis import rm_anova`. The links beside this file show them to tools that
look for files.
"""
