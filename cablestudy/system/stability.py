"""Stability of an equilibrium: the eigenvalues of its stiffness, and the motion that is not held."""
