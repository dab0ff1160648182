"""Numbers that people give to how strong a stimulus is: magnitude estimation."""
