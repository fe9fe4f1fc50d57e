"""Triangle surfaces: edges, decimation, dense-to-coarse embedding, skin weights."""
