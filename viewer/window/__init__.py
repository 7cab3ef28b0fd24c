"""The desktop window: its events, its panel, and what can be dropped on it."""
