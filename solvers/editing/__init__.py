"""Changes an animated shape and keeps its motion: AniMesh (Jin et al. 2015), section 6."""
