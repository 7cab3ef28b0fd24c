"""One file for each target of `mplicits bake`, and shared parts."""
