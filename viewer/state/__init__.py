"""What is shown, and the work that goes on beside it."""
