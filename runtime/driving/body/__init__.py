"""Driving a body limb by limb: which limbs correspond, how they are posed, how the body stands."""
