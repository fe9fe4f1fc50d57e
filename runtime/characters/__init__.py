"""Characters: read from mesh and rig files, or built in."""
