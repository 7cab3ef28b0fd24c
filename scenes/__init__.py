"""A scene's file -> a model file: models that are placed and joined."""
