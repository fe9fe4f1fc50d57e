"""Recordings of markers on a body (C3D, TRC, tables): which marker is where, and the joints."""
