"""Everything that touches the participant or the stimulus, and a simulated twin of each."""

if __name__ != "palpate.devices":
    raise ImportError("this package is palpate.devices: from palpate import devices")
