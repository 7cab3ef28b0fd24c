"""The desktop window: its events, its panel, and files dropped on it."""
