"""A mesh or an oriented point cloud becomes a small multiscale neural signed distance function, baked into shaders.

Its rooms are `model` (the model file), `glsl` (shaders written by hand), `codegen` (from a model to shader source),
`trainer` (from a shape to a model), `mesher` (from a model to a mesh) and `viewer` (from a model to a picture or a
window). `cli` is the command line.
"""
