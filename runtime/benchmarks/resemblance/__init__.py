"""What is measured of a character beside the performer who drives it."""
