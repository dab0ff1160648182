"""Analogue sensors through data acquisition cards: the card, its twin, and what is wired to it."""
