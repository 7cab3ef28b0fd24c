"""The web pages, and the ES module. Each folder holds scripts, with their HTML, style and shaders."""
