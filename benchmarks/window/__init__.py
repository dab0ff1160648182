"""The participant's window: screens, gestures, whole sessions."""
