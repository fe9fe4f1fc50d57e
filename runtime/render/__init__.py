"""The stage, drawn with moderngl; beside the window, only this package calls OpenGL."""
