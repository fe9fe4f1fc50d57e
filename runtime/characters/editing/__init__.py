"""Characters are cut in two and merged, with all that their surfaces carry."""
