"""Models as flat programs of a small kernel in C: compiled when the package is installed, if a compiler is there."""
