"""Faults of the machine: full disks, read errors, interrupts."""
