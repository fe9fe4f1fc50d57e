"""What a puppeteer can do during a show: actions, keys, window, OSC remote control."""
