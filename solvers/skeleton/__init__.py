"""Skeletons: trees, extraction from a surface, forward kinematics, anchors in a surface."""
