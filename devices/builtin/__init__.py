"""The built-in performer, which needs no hardware: `sim://`."""
