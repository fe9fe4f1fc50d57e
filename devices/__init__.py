"""Where performers come in: one module per sensor or protocol, each yields `SkeletonFrame`s."""
