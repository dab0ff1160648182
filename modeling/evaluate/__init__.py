"""Evaluating methods side by side: the jobs of an evaluation, computed once and saved on disk."""
