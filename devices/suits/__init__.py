"""Motion-capture suits: Rokoko Studio and Xsens MVN."""
