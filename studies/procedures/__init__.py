"""The procedures that choose levels: each kind is a module of this folder, found by its name."""
