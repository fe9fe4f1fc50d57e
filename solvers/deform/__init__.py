"""Parts of the deformation solvers: handles, cells, rotations, volume, skinning."""
