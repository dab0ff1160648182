"""The renderer's window: a texture's picture at true size to stroke over, what is played, and how time is kept."""
