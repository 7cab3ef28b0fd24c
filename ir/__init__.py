"""The program: a model's computation as a few ops on vectors of vec4, and the lowering from model to program."""
