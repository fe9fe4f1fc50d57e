"""Device adapters: each sensor or protocol becomes a stream of `SkeletonFrame`s (metres, +Y up)."""
