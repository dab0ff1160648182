"""Pictures of samples, as a camera puts them into a folder."""
