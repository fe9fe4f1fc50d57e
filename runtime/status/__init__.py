"""What a show tells people: what it sees, what drives what, what has just happened."""
