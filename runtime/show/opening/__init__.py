"""Opening a show: where it is drawn, what it writes, and all other parts, in order."""
