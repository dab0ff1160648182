"""The compiled kernel in C that runs models, and the modules that compile programs for it."""
