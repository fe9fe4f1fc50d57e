"""Readers of recordings by capture studios and laboratories: Acclaim, MVNX, OptiTrack, SMPL."""
