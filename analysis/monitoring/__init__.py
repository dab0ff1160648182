"""The monitor of a lab: its sessions, the balance of its orders and how its raters answer, on a read-only page."""
