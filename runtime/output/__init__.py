"""What a performance leaves behind: video, pictures, point caches, animated models, reports."""
