"""The program: what a model computes, as a handful of ops on packed vectors."""
