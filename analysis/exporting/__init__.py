"""Sharing a study's data: BIDS, Psych-DS, plain CSV, Parquet; nothing that says who somebody is."""
