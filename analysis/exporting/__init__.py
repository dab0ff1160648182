"""Sharing a study's data as BIDS, Psych-DS, plain CSV or Parquet, without anything that identifies a person."""
