"""The car-door simulator's controller, emulated: a state machine fed with bytes; a tick is 1 ms of the plant."""
