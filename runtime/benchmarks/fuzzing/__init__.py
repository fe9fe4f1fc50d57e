"""The fuzzer: small valid inputs of each door, damage, and the watch over what it does."""
