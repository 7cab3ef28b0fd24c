"""The ground that every room stands on: the model and its file, the gallery, output files, errors, what a verb is."""
