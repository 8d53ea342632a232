"""Independent static reference for softvt's soft bodies: own mesh, element, contact and Newton solver (SI units)."""
