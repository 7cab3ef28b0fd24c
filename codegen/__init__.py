"""From a model file to a program of a few ops, and from that to one source file per target. Loads no torch, no GL."""
