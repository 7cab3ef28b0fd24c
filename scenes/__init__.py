"""The file of a scene -> a model file: models placed and combined."""
