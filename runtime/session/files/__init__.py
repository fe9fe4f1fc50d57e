"""Sessions on the disk: the folder of an open session, and the file that is made of it."""
