"""Models of doors, the keyswitch, the designer's window and the door that changes in the hand."""
