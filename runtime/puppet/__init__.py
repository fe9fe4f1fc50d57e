"""A character that can be moved: its deformable surface and its skeleton."""
