"""The procedures that choose levels: each kind is a module of this folder, listed in `adviser.py`."""
