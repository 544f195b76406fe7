"""One cable, or arrays of cables: closed-form catenary, elements of any order, their stiffness, mass and modes."""
