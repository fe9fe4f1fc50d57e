"""The fuzzer: valid inputs of each reader and decoder, random damage, and a watch over both."""
