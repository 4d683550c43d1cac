"""The reader of SDF files (sdformat.org/spec, versions 1.4 to 1.12): frames, joints, inertias, shapes."""
