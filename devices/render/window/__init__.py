"""The renderer's window: a texture's picture at true size to stroke over, the output, and its timing."""
