"""Read recordings of the Leap Motion's messages."""
