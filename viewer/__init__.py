"""Shows models: `mplicits render` draws a picture, `mplicits view` opens a window. Nothing here imports torch."""
