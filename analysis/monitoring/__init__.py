"""Watching a lab: its sessions, the balance of its orders and how its raters answer, on a page that only reads."""
