"""The training loop that all networks of the project share, with its checkpoints and jobs."""
