"""Before a session starts: which plan it runs, and whether the study, the screen and the day are as they must be."""
