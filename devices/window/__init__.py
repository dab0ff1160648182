"""The participant's window: screens as pure state, layout and painting; a real window only when one is opened."""
