"""Trained models as files: cards, their weights, and the runtime that plays them."""
