"""Streams of different clocks and rates on one grid."""
