"""Readers of what capture studios and laboratories write."""
