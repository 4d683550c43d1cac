"""Iterative inverse kinematics of any traced pose error, independent of robots: native code over batches."""
