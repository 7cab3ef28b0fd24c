"""The ground that every room stands on: a model and its file, the gallery, mesh files, output files, errors, verbs."""
