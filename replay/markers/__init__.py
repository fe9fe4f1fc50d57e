"""Recordings of markers on a body (C3D, TRC, tables): marker names, and the joints beneath them."""
