"""The model file, its checks and its gallery; errors and files: the ground that every room stands on."""
