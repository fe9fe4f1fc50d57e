"""The panel over the picture in the window: what is going on, what to press, and the sliders."""
