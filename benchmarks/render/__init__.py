"""The renderer's loop."""
