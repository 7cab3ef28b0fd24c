"""The program: what a model computes, as a handful of ops on vectors of vec4, and how a model becomes one."""
