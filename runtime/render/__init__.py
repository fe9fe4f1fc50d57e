"""The puppet stage drawn with moderngl: the only part of the runtime that touches GL."""
