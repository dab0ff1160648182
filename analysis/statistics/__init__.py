"""Tests that give the right number or refuse by name, and their exact oracle. Plans name them in `plans/families/`."""
