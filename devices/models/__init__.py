"""Trained models at the rig: read from their files, run with NumPy or the compiled kernel, listed and compared.

`palpate.modeling.files.model_files` writes such a file, `palpate.signals.models.file` reads it.
"""
