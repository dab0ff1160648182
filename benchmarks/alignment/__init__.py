"""Aligning streams on one grid."""
