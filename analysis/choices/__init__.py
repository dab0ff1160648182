"""Choices: scales from comparisons of pairs, and psychometric functions."""
