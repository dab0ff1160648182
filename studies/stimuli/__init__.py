"""What a stimulus is made of where it is presented: door profiles, scenes of sensors, doors from wishes, renderings."""
