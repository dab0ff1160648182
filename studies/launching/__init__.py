"""Before a session starts: which plan it runs, and whether study, screen and date are the right ones."""
