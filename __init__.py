"""A mesh or an oriented point cloud becomes a small multiscale neural signed distance function, baked into shaders.

The rooms: `model` (the model file), `glsl` (shaders written by hand), `codegen` (model -> shader source), `trainer`
(shape -> model), `mesher` (model -> mesh), `viewer` (model -> picture or window), `cli` (the command line).
"""
