"""Human skeletons: joint names, body parts, standard bodies, and poses in world coordinates."""
