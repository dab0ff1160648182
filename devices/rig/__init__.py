"""A lab's devices as one file names them: the rig."""
