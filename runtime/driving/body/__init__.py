"""Driving a body limb by limb: what corresponds, how it is posed, and how it stands."""
