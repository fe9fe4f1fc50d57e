"""The nodes by which a body without a rig is driven limb by limb."""
