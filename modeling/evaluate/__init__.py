"""Comparative evaluation of methods: the jobs of an evaluation, computed once and saved on disk."""
