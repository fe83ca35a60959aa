"""Equal hard disks on a flat torus."""
