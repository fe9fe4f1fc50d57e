"""Outputs that are files: video, pictures, point caches, animated models."""
