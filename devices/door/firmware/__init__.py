"""An emulation of the car-door simulator's controller: a state machine that reads bytes; a tick is 1 ms of the
plant.
"""
