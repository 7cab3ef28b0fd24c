"""From a program of a few ops to the source text of each target. Loads no torch, no GL."""
