"""The door simulator's plant and control: arm, motor, brake, stops, sensors, hand, 1 kHz cascade; pure Python."""
