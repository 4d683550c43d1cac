"""The reader of URDF files (wiki.ros.org/urdf/XML): XML elements, joints, inertias, transmissions, shapes."""
