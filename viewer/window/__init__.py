"""The window: events, panel, what can be dropped on it."""
