"""Cables, bodies and junctions that move: superelements of cables, and the linear system that they make up."""
