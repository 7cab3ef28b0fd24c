"""The viewer without its window: the model on the screen, its picture, and background work."""
