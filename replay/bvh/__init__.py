"""Read and write BVH motion-capture files."""
