"""Pictures of samples, as a camera saves them to a folder."""
