"""Features of recordings and pictures of textures, for models of attributes (thesis 3.4).

Those of doors are in `palpate.signals.doors`.
"""
