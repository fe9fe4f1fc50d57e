"""Plans of bodies unlike a person's, by their shape: many legs, no legs, wings, a hand."""
