"""How a performer drives characters: matching, mapping, and the motion that is transferred."""
