"""One file for each target of `mplicits bake`."""
