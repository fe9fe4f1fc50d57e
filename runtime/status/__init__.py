"""What a show says of itself: what it sees, what drives what, what has just happened."""
