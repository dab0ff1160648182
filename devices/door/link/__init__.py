"""The car-door simulator from the host's side: frames and messages on a serial line, the dialogue, the device."""
