"""What a window shows and the work that goes on beside it, without the window."""
