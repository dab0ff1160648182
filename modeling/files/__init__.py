"""Trained models as files: weights that cannot execute code, and a card that says what they are."""
