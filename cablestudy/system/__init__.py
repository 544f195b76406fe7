"""Cables, bodies and junctions: equilibrium, superelements of cables, and the linear system that they make up."""
