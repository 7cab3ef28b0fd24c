"""What a program computes, in numpy: the oracle of every target."""
