"""The door simulator's plant and control: arm, motor, brake, stops, sensors, hand, the 1 kHz cascade; plain Python."""
