"""The built-in performer, who needs no hardware: `sim://`."""
