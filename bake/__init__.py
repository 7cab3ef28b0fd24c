"""The verbs `bake` and `info`, and the table of targets: a model file becomes a file of a target."""
