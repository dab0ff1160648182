"""Recordings and pictures of textures as numbers: what models of attributes learn from (thesis 3.4).

Those of doors are in `palpate.signals.doors`.
"""
