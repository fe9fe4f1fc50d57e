"""Sessions on the disk: the folder that is written while one is edited, and the file made of it."""
