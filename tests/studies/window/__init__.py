"""Whole sessions in the real window: a hand at the mouse, orders at the console, the ledger between them."""
