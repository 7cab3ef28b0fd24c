"""OpenGL contexts, and what draws a frame in one."""
