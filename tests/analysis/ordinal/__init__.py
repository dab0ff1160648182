"""Tests of the ordinal statistics."""
