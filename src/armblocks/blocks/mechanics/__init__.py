"""Bodies and joints as blocks: frames, solids, joints, forces, sensors of mechanisms."""
