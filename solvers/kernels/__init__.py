"""How compiled code is made and cached; vector and quaternion types for use inside it."""
