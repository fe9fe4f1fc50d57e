"""The session: takes, the clips that play them, edits with undo, and the file that keeps them."""
