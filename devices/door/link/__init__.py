"""The car-door simulator as the host sees it: frames and messages on a serial line, the dialogue, the device."""
