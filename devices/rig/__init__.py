"""The rig: a lab's devices as listed in one file."""
