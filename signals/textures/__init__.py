"""Play textures sample by sample: a model run on its own output, within limits."""
