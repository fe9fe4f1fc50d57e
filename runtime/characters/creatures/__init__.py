"""Bodies that people do not have, such as those of many legs, by their shape."""
