"""Iterative inverse kinematics of any traced pose error, as native code over batches. It knows no robot."""
