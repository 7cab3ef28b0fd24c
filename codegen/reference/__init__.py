"""What a program computes, in numpy: every target is tested against it."""
