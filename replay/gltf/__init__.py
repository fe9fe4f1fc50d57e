"""glTF, GLB and VRM files: container and nodes, which characters use too, and animations."""
